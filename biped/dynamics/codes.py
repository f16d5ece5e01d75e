"""How a stage, a step or a march can end."""

OK, INDEFINITE, NOT_FINITE, NOT_PROJECTED, TOO_MANY_RETRIES, UNSETTLED, SPILLED, EVENT, NOT_LEAPT = range(9)
