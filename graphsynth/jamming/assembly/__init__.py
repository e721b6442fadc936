"""Where the assemblies of a mechanism lie: structural groups with a closed form."""
