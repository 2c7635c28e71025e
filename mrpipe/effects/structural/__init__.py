"""Effects of a structure that a linear frame lacks, one file each."""
