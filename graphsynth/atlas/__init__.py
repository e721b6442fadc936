"""The catalogue of chains and mechanisms: store, questions, checks, and the atlas page."""
