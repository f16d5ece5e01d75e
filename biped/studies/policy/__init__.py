"""Learned policies: their cards from what trainers write, and checks of a card before anything is judged by it."""
