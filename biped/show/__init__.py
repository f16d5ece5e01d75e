"""How results are shown: terminal, Markdown, figures, recordings."""
