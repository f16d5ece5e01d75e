"""Control laws of robots of any kind: what they are told and sense, and those that a scenario names."""
