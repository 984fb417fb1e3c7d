"""The spring model: closed form, one step at a time and whole paths; knows nothing of files, FMI or plots."""
