"""The experiments of the chapter, one scenario file each."""
