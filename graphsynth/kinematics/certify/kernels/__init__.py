"""Kernels of certificates of motions: equations enclosed, boxes proved, and the march from box to box."""
