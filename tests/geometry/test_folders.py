import numpy as np
import pytest
import trimesh

from graspbench.errors import MeshError
from graspbench.geometry import ObjectParameters, list_folder, load_object


@pytest.fixture
def plain(tmp_path):
    for k, name in enumerate(("c.stl", "a.ply", "b.obj")):
        trimesh.creation.box((0.04, 0.05, 0.06 + 0.01 * k)).export(tmp_path / name)
    (tmp_path / "notes.txt").write_text("not a mesh")
    return tmp_path


@pytest.fixture
def ycb(tmp_path):
    """Two objects laid out as the YCB set is; scans with a stray shell, a hole, and duplicated vertices."""
    scan = trimesh.creation.icosphere(3, 0.04)
    scan.update_faces(np.arange(len(scan.faces)) != 7)
    dust = trimesh.creation.icosphere(1, 0.002).apply_translation((0.08, 0.0, 0.0))
    for name in ("003_cracker_box", "005_tomato_soup_can"):
        folder = tmp_path / "ycb" / name / "google_16k"
        folder.mkdir(parents=True)
        trimesh.util.concatenate([scan, dust]).export(folder / "nontextured.stl")
        scan.export(folder / "textured.obj")
        (folder.parent / "clouds").mkdir()
        trimesh.PointCloud(scan.vertices).export(folder.parent / "clouds" / "merged_cloud.ply")
        other = folder.parent / "tsdf"
        other.mkdir()
        scan.export(other / "nontextured.ply")
        (folder / "kinbody.xml").write_text("<KinBody/>")
    return tmp_path / "ycb"


def test_meshes_are_numbered_in_alphabetical_order(plain):
    assert [item.name for item in list_folder(plain)] == ["a", "b", "c"]
    heights = [
        load_object(ObjectParameters(folder=str(plain), id=which)).extents_m[2]
        for which in (0, 1, "2", "c", None)
    ]
    np.testing.assert_allclose(heights, [0.07, 0.08, 0.06, 0.06, 0.07], atol=1e-6)


def test_subfolders_are_searched_when_the_folder_has_no_mesh(plain):
    assert [item.name for item in list_folder(plain.parent)][:3] != []
    inner = plain / "deep" / "er"
    inner.mkdir(parents=True)
    (plain / "a.ply").rename(inner / "a.ply")
    assert [item.name for item in list_folder(plain / "deep")] == ["a"]


def test_ycb_objects_are_found_repaired_and_reported(ycb):
    assert [item.name for item in list_folder(ycb)] == ["003_cracker_box", "005_tomato_soup_can"]
    for which in ("003_cracker_box", "cracker_box", 0):
        model = load_object(ObjectParameters(folder=str(ycb), id=which))
        assert model.name == "003_cracker_box"
        assert model.report.bodies == 1
        assert "google_16k" in model.source
        assert "CC BY" in model.licence
        text = " ".join(model.report.repairs)
        assert "1 hole was closed" in text
        assert "1 stray piece was dropped" in text


def test_one_ycb_object_is_a_folder_too(ycb):
    for folder in ("005_tomato_soup_can", "005_tomato_soup_can/google_16k"):
        (item,) = list_folder(ycb / folder)
        assert (item.name, item.path.name, item.ycb) == ("005_tomato_soup_can", "nontextured.stl", True)


@pytest.mark.parametrize(
    ("which", "words"), [(3, "no mesh '3'"), ("z", "no mesh 'z'"), (-1, "no mesh '-1'"), ("", "no mesh ''")]
)
def test_what_is_not_there_is_named_with_what_is(plain, which, words):
    with pytest.raises(MeshError) as caught:
        load_object(ObjectParameters(folder=str(plain), id=which))
    assert words in str(caught.value)
    assert "0 to 2" in str(caught.value)


def test_missing_and_empty_folders(tmp_path):
    with pytest.raises(MeshError, match="no folder"):
        load_object(ObjectParameters(folder=str(tmp_path / "none")))
    with pytest.raises(MeshError, match="holds no mesh"):
        load_object(ObjectParameters(folder=str(tmp_path)))
