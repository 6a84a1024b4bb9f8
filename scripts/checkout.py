# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes this checkout importable as the package `true_diffuse`, whatever its folder is called.

Inside Blender the extension is a package of which `addon` and `scenes` are parts; here it is the same, without installing it.
"""

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

if "true_diffuse" not in sys.modules:
    spec = importlib.util.spec_from_file_location("true_diffuse", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)])
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["true_diffuse"] = module
    spec.loader.exec_module(module)
