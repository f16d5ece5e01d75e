"""Whoever imports this keeps MuJoCo from writing to the user's folder: done where model files are parsed.

Without a handler every warning of MuJoCo's is appended to MUJOCO_LOG.TXT there. A run's warnings are in its data, where
the engines read them.
"""

from __future__ import annotations

import mujoco

mujoco.set_mju_user_warning(lambda message: None)
