"""Parts of the engine `drake`: a plant of Drake's from a compiled MuJoCo model, its contacts, its steps."""
