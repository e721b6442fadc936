"""The braiding mechanism: four-bar linkage with switch and thread, driven by a synchronous motor through a train."""
