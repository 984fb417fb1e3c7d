"""What records show that is neither the spring's nor an effect of the rig that can be removed."""
