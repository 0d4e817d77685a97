"""The notebooks run, and print their stored outputs.

After a change: ``jupyter execute --inplace notebooks/NAME.ipynb``, and look at the pictures.
"""

import copy
import os
import pathlib

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

FOLDER = pathlib.Path(__file__).parents[1] / "notebooks"
NAMES = ["friction", "mountain", "stiffness"]


def outputs(notebook):
    """Returns the printed text and the number of pictures of each cell."""
    of_cells = []
    for cell in notebook.cells:
        shown = cell.get("outputs", [])
        printed = [output.text for output in shown if output.get("name") == "stdout"]
        pictures = ["image/png" in output.get("data", {}) for output in shown]
        of_cells.append(("".join(printed), sum(pictures)))
    return of_cells


@pytest.mark.parametrize("name", NAMES)
def test_notebook_prints_its_stored_output(name):
    if name == "stiffness" and "HAPTERRA_LAB" not in os.environ:
        pytest.skip("cargo xtask python --test names hapterra-lab")
    stored = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    resources = {"metadata": {"path": str(FOLDER)}}
    ran = copy.deepcopy(stored)
    nbclient.NotebookClient(ran, timeout=None, resources=resources).execute()
    assert outputs(ran) == outputs(stored)
    assert any(pictures for _, pictures in outputs(stored))


def test_every_notebook_is_run():
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == NAMES
