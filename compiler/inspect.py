"""What a SceneIR holds, in figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compiler.ir import KINDS, MESH, SceneIR, leaf_counts
