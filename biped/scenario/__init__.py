"""Files that users write, typed and checked: scenarios, gains and families of gaits."""
