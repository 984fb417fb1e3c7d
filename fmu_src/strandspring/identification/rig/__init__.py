"""Effects of the test rig: found, judged against what mounts do, and removed or kept."""
