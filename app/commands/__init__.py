"""The commands of `himpc-lab`, one file each."""
