"""Many springs and many cases: jobs that can be resumed, studies, batches of records, and the planning of tests."""
