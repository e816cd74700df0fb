# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Makes the contract's stubs when the package is built, and asks for the version of the sources. All else is in
pyproject.toml."""

import pathlib
import sys

from setuptools import setup
from setuptools.command.build_py import build_py

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from make_stubs import make_stubs, version_of_sources  # noqa: E402


class BuildWithStubs(build_py):
    def run(self):
        super().run()
        make_stubs(pathlib.Path(self.build_lib))


setup(version=version_of_sources(), packages=["ccslice"], package_data={"ccslice": ["py.typed"]},
      cmdclass={"build_py": BuildWithStubs})
