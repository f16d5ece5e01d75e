"""What a user writes: typed, checked, overridable; gains and families of gaits."""
