"""Standard tests of gaits: what each withstands, searched to failure, one table for all (docs/standard.md)."""
