from pathlib import Path

import pytest
import trimesh

from graspbench.geometry import ObjectParameters, list_folder, load_object
from graspbench.geometry.naming import distinct_names, file_label, mesh_name


def write(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.creation.box((0.04, 0.05, 0.06)).export(path)
    return path


@pytest.mark.parametrize(
    ("path", "name", "label"),
    [
        ("/data/mug/textured.obj", "mug", "mug/textured.obj"),
        ("/ycb/025_mug/google_16k/nontextured.ply", "025_mug", "025_mug/google_16k/nontextured.ply"),
        ("/cad/bracket/meshes/visual/Mesh.STL", "bracket", "bracket/meshes/visual/Mesh.STL"),
        ("/data/cup.stl", "cup", "cup.stl"),
        ("/mesh.obj", "mesh", "mesh.obj"),
    ],
)
def test_a_name_that_says_nothing_gives_way_to_the_folders(path, name, label):
    assert mesh_name(Path(path)) == name
    assert file_label(Path(path)) == label


def test_neighbours_of_one_name_are_told_apart(tmp_path):
    small, large = write(tmp_path / "small" / "cup.stl"), write(tmp_path / "large" / "cup.stl")
    alone = write(tmp_path / "large" / "plate.stl")
    assert [mesh_name(path) for path in (small, large, alone)] == ["small_cup", "large_cup", "plate"]


def test_a_link_to_a_files_own_folder_is_no_neighbour(tmp_path):
    path = write(tmp_path / "run_3" / "cup.stl")
    (tmp_path / "run_latest").symlink_to(path.parent)
    assert mesh_name(path) == "cup"


def test_no_two_meshes_of_a_folder_are_called_alike(tmp_path):
    files = ["a.obj", "a.stl", "x/b.ply", "y/b.ply", "c/textured.obj", "d/textured.obj", "e/f/mesh.obj"]
    files += ["g_h/i.obj", "g/h_i.obj", "g/i.obj"]
    paths = [tmp_path / file for file in files]
    names = distinct_names(paths, tmp_path)
    assert names == ["a_obj", "a_stl", "x_b", "y_b", "c", "d", "f", "g_h_i", "h_i", "g_i"]
    clash = [tmp_path / file for file in ("g_h/i.obj", "g/h_i.obj", "g/k/i.obj", "g/h/i.obj")]
    assert len(set(distinct_names(clash, tmp_path))) == 4


def test_objects_of_one_file_name_are_listed_and_picked_by_their_folders(tmp_path):
    for name in ("mug", "bowl"):
        write(tmp_path / name / "textured.obj")
    assert [item.name for item in list_folder(tmp_path)] == ["bowl", "mug"]
    assert load_object(ObjectParameters(folder=str(tmp_path), id="mug")).name == "mug"


def test_a_name_that_is_given_comes_first(tmp_path):
    path = str(write(tmp_path / "mug" / "textured.obj"))
    assert load_object(ObjectParameters(mesh=path)).name == "mug"
    assert load_object(ObjectParameters(mesh=path, name="banana")).name == "banana"
