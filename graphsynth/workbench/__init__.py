"""The workbench: a page on which mechanisms are drawn, dragged and kept, written as files that open from a disk."""
