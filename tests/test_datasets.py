import hashlib

import pytest
from plycloth import datasets
from plycloth.datasets import DatasetError

NAME = "photos/satin1_R.png"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name in ["photos/silk_R.png", "photos/silk_T.png", "photos/half_R.png", "hdr/sky.exr"]:
        file = tmp_path / "mine" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(name.encode())
    monkeypatch.setenv(datasets.FOLDER_VARIABLE, str(tmp_path / "mine"))
    return tmp_path / "mine"


@pytest.fixture
def no_folder(tmp_path, monkeypatch):
    monkeypatch.delenv(datasets.FOLDER_VARIABLE, raising=False)
    monkeypatch.setattr(datasets.pooch, "os_cache", lambda project: tmp_path / "cache" / project)


def serve(monkeypatch, content):
    asked = []

    def download(url, output_file, pooch):
        asked.append(url)
        with open(output_file, "wb") as file:
            file.write(content)

    monkeypatch.setattr(datasets, "_download", download)
    return asked


def test_files_of_the_own_folder_are_found(folder):
    assert datasets.path("hdr/sky.exr") == folder / "hdr" / "sky.exr"
    assert datasets.hdri("sky") == folder / "hdr" / "sky.exr"
    assert datasets.names("photos") == (
        "photos/half_R.png",
        "photos/silk_R.png",
        "photos/silk_T.png",
    )
    assert datasets.photo_pairs() == ("silk",)
    assert datasets.photo_pair("silk") == (
        folder / "photos" / "silk_R.png",
        folder / "photos" / "silk_T.png",
    )


@pytest.mark.parametrize(
    ("call", "wrong", "nearest"),
    [
        (datasets.path, "photos/satin1_r.png", "photos/satin1_R.png"),
        (datasets.photo_pair, "satn2", "satin2"),
        (datasets.hdri, "studo", "studio"),
        (datasets.names, "photo", "photos"),
    ],
)
def test_unknown_names_come_with_the_nearest(no_folder, call, wrong, nearest):
    with pytest.raises(ValueError, match=f"{wrong}.*nearest is '{nearest}'"):
        call(wrong)


def test_of_names_like_no_other_the_message_lists_some_that_there_are(no_folder):
    with pytest.raises(ValueError, match=r"'xyz' is unknown; there are '.*', '.*'$"):
        datasets.photo_pair("xyz")
    with pytest.raises(ValueError, match=r"there are '.*' and \d+ more$"):
        datasets.path("xyz")


def test_unknown_names_in_the_own_folder_come_with_the_nearest(folder):
    with pytest.raises(ValueError, match=r"nearest is 'hdr/sky\.exr'"):
        datasets.path("hdr/skyy.exr")
    with pytest.raises(ValueError, match="unknown"):
        datasets.path("../mine/hdr/sky.exr")


def test_the_own_folder_may_lack_a_known_file(folder):
    with pytest.raises(DatasetError, match=r"satin1_R\.png: is not in the folder"):
        datasets.path(NAME)


def test_the_own_folder_must_exist(monkeypatch, tmp_path):
    monkeypatch.setenv(datasets.FOLDER_VARIABLE, str(tmp_path / "gone"))
    for call in (lambda: datasets.path(NAME), datasets.names):
        with pytest.raises(DatasetError, match="gone', which is not a folder"):
            call()


def test_a_download_is_kept_and_checked(no_folder, monkeypatch, tmp_path):
    content = b"a photograph"
    known = datasets.registry()[NAME]
    honest = datasets.DataFile(
        NAME, hashlib.sha256(content).hexdigest(), known.source, known.licence, known.url
    )
    monkeypatch.setattr(datasets, "registry", lambda: {NAME: honest})
    asked = serve(monkeypatch, content)
    found = datasets.path(NAME)
    assert found == tmp_path / "cache" / "plycloth" / "photos" / "satin1_R.png"
    assert found.read_bytes() == content
    assert datasets.path(NAME) == found
    assert asked == [known.url]


def test_a_wrong_checksum_is_refused(no_folder, monkeypatch, tmp_path):
    serve(monkeypatch, b"something else")
    with pytest.raises(DatasetError, match=r"satin1_R\.png.*checksum"):
        datasets.path(NAME)
    assert not (tmp_path / "cache" / "plycloth" / "photos" / "satin1_R.png").exists()


def test_being_offline_is_said(no_folder, monkeypatch):
    def fail(url, output_file, pooch):
        raise ConnectionError("no route to host")

    monkeypatch.setattr(datasets, "_download", fail)
    with pytest.raises(DatasetError, match=r"no route to host.*set PLYCLOTH_DATA"):
        datasets.path(NAME)


def test_what_has_no_address_says_where_it_comes_from(no_folder):
    with pytest.raises(DatasetError, match=r"@pmndrs/assets 1\.7\.0.*set PLYCLOTH_DATA"):
        datasets.hdri("studio")


def test_addresses_are_quoted_and_pinned():
    url = datasets.registry()["wif/dtx_to_wif/src_test_data_bad_wif_missing_tieup.wif"].url
    assert url == (
        "https://github.com/r-owen/dtx_to_wif/raw/cbfd856/src/test_data/bad_wif/missing%20tieup.wif"
    )


def test_every_entry_is_whole():
    for name, file in datasets.registry().items():
        assert file.name == name
        assert len(bytes.fromhex(file.sha256)) == 32
        assert file.licence
        assert file.source


@pytest.mark.data
def test_the_registry_describes_the_real_files():
    for name, file in datasets.registry().items():
        content = datasets.path(name).read_bytes()
        assert hashlib.sha256(content).hexdigest() == file.sha256, name
