"""The foreign engine for robots of any kind: MuJoCo, tick by tick, with the law in Python."""
