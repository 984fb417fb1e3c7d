"""Many tasks on all cores or on a cluster, with a journal of what is finished; used by studies and batches."""
