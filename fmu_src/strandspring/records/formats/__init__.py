"""Binary formats of records: each module reads the tables of one of them."""
