"""Benches of chapter II's library: run time against error, and the leg that hangs on the bench of chapter IV."""
