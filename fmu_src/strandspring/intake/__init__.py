"""Records from what a user gives: paths, description files of campaigns, and what to select of them."""
