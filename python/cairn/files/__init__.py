"""Files of runs, scenes and checkpoints: the growing HDF5 file, its writer and readers."""
