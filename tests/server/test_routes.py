"""What each path answers, and how each thing that can be wrong is told."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from httpx2 import Response

import ovolo
from server.settings import Settings

BALL = """\
sphere()
camera(from: (0, 0, 10), at: (0, 0, 0), fov: 20deg)
settings(width: 16, height: 12, samples: 1)
"""
FAULTY = "spher()\n"
PLAIN = {"Content-Type": "text/plain"}
SCENE_PATHS = ("/v1/check", "/v1/compile", "/v1/render")


def problem(response: Response, status: int, kind: str) -> dict[str, Any]:
    """The body of a problem, which must be one."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    body: dict[str, Any] = response.json()
    assert body["type"] == f"urn:ovolo:problem:{kind}"
    assert body["status"] == status
    assert body["title"]
    assert body["detail"]
    return body


def test_the_service_is_there(client: TestClient) -> None:
    response = client.get("/healthz")
    assert response.json() == {"status": "ok", "version": ovolo.__version__}


def test_a_sound_scene_is_ok(client: TestClient) -> None:
    answer = client.post("/v1/check", json={"source": BALL}).json()
    assert answer == {"ok": True, "diagnostics": []}


def test_faults_are_the_answer_of_a_check(client: TestClient) -> None:
    response = client.post("/v1/check", json={"source": FAULTY, "name": "a.ovo"})
    assert response.status_code == 200
    answer = response.json()
    assert answer["ok"] is False
    assert [fault["code"] for fault in answer["diagnostics"]] == ["name-unknown"]


def test_faults_come_as_text_too(client: TestClient) -> None:
    response = client.post(
        "/v1/check?name=a.ovo", content=FAULTY, headers={**PLAIN, "Accept": "text/plain"}
    )
    assert response.headers["content-type"].startswith("text/plain")
    assert response.text.startswith("error[name-unknown]: ")
    assert " --> a.ovo:1:1" in response.text


def test_a_program_is_formatted(client: TestClient) -> None:
    loose = {"source": "sphere( 1 )"}
    assert client.post("/v1/format", json=loose).text == "sphere(1)\n"
    response = client.post("/v1/format", json=loose, headers={"Accept": "application/json"})
    assert response.json() == {"source": "sphere(1)\n"}
    marked = {"source": "\ufeffsphere( 1 )\r\n"}
    assert client.post("/v1/format", json=marked).text == "sphere(1)\n"
    faulty = client.post("/v1/format", json={"source": "sphere(1"})
    assert problem(faulty, 422, "scene-faults")["diagnostics"][0]["code"] == "syntax-unclosed"


def test_a_scene_is_summarized_or_printed(client: TestClient) -> None:
    body = {"source": BALL}
    assert client.post("/v1/compile", json=body).json()["instances"] == 1
    response = client.post("/v1/compile", json=body, headers={"Accept": "text/plain"})
    assert "sphere" in response.text


@pytest.mark.parametrize(
    ("accept", "media_type", "magic"),
    [
        ("*/*", "image/png", b"\x89PNG"),
        ("image/png", "image/png", b"\x89PNG"),
        ("image/jpeg", "image/jpeg", b"\xff\xd8\xff"),
        ("image/x-exr", "image/x-exr", b"\x76\x2f\x31\x01"),
    ],
)
def test_a_picture_comes_as_accepted(
    client: TestClient, accept: str, media_type: str, magic: bytes
) -> None:
    response = client.post("/v1/render", content=BALL, headers={**PLAIN, "Accept": accept})
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == media_type
    assert response.content.startswith(magic)
    assert int(response.headers["ovolo-rays"]) >= 16 * 12
    assert response.headers["ovolo-warnings"] == "0"
    assert "render;dur=" in response.headers["server-timing"]


def png_size(content: bytes) -> tuple[int, int]:
    return int.from_bytes(content[16:20]), int.from_bytes(content[20:24])


def test_a_picture_is_as_the_scene_or_the_request_asks(client: TestClient) -> None:
    by_scene = client.post("/v1/render", content=BALL, headers=PLAIN)
    by_query = client.post("/v1/render?width=8&height=9", content=BALL, headers=PLAIN)
    by_body = client.post(
        "/v1/render",
        json={"source": BALL, "width": 8, "height": 9, "integrator": "normals", "camera": 0},
    )
    assert png_size(by_scene.content) == (16, 12)
    assert png_size(by_query.content) == (8, 9) == png_size(by_body.content)
    assert by_query.content != by_body.content


def test_json_rays_give_json_hits(client: TestClient) -> None:
    response = client.post(
        "/v1/rays",
        json={"source": BALL, "origins": [[0, 0, 3], [5, 0, 3]], "directions": [0, 0, -1]},
    )
    assert response.json() == {
        "t": [2.0, None],
        "position": [[0.0, 0.0, 1.0], None],
        "normal": [[0.0, 0.0, 1.0], None],
        "instance": [0, -1],
        "prototype": [0, -1],
        "material": [0, -1],
    }


def archive(**arrays: object) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **{name: np.asarray(array) for name, array in arrays.items()})  # type: ignore[arg-type]
    return stream.getvalue()


def test_archived_rays_give_archived_hits(client: TestClient) -> None:
    body = archive(
        source=BALL, origins=[[0, 0, 3], [5, 0, 3]], directions=[0, 0, -1], precision="float32"
    )
    response = client.post("/v1/rays", content=body, headers={"Content-Type": "application/x-npz"})
    assert response.headers["content-type"] == "application/x-npz"
    hits = np.load(io.BytesIO(response.content))
    assert hits["t"].tolist() == pytest.approx([2.0, np.inf])
    assert hits["instance"].tolist() == [0, -1]
    assert hits["instance"].dtype == np.int64
    assert np.isnan(hits["normal"][1]).all()
    asked = {"Content-Type": "application/x-npz", "Accept": "application/json"}
    assert client.post("/v1/rays", content=body, headers=asked).json()["instance"] == [0, -1]


@pytest.mark.parametrize("path", ["/v1/compile", "/v1/render", "/v1/rays"])
def test_a_faulty_scene_is_a_problem_with_diagnostics(client: TestClient, path: str) -> None:
    body = {"source": FAULTY}
    if path == "/v1/rays":
        body |= {"origins": [0, 0, 0], "directions": [0, 0, 1]}  # type: ignore[dict-item]
    answer = problem(client.post(path, json=body), 422, "scene-faults")
    assert [fault["code"] for fault in answer["diagnostics"]] == ["name-unknown"]
    assert answer["rendered"].startswith("error[name-unknown]: ")


@pytest.mark.parametrize("path", SCENE_PATHS)
@pytest.mark.parametrize(
    ("content", "media_type", "status", "kind"),
    [
        (b"sphere()", "application/x-www-form-urlencoded", 415, "unsupported-media-type"),
        (b"sphere()", "", 415, "unsupported-media-type"),
        (b"not json", "application/json", 422, "invalid-body"),
        (b"[]", "application/json", 422, "invalid-body"),
        (b"{}", "application/json", 422, "invalid-body"),
        (b'{"source": 7}', "application/json", 422, "invalid-body"),
        (b'{"source": "", "colour": 1}', "application/json", 422, "invalid-body"),
        (b'{"source": "", "name": ""}', "application/json", 422, "invalid-body"),
        (b'{"source": "\\ud800"}', "application/json", 422, "invalid-body"),
        (b"sph\xff", "text/plain", 422, "invalid-body"),
        (b"sph\xff", "text/plain; charset=utf-8", 422, "invalid-body"),
    ],
)
def test_bodies_that_do_not_fit_are_problems(
    client: TestClient, path: str, content: bytes, media_type: str, status: int, kind: str
) -> None:
    problem(client.post(path, content=content, headers={"Content-Type": media_type}), status, kind)


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"width": 0}, "width"),
        ({"height": -1}, "height"),
        ({"samples": 1.5}, "samples"),
        ({"integrator": "magic"}, "integrator"),
        ({"precision": "float16"}, "precision"),
        ({"max_seconds": 0}, "max_seconds"),
        ({"camera": "side"}, "side"),
        ({"camera": 3}, "camera"),
        ({"seed": -1}, "seed"),
    ],
)
def test_settings_that_cannot_be_are_named(
    client: TestClient, settings: dict[str, object], field: str
) -> None:
    response = client.post("/v1/render", json={"source": BALL, **settings})
    assert response.status_code == 422
    assert field in response.json()["detail"]
    query = client.post("/v1/render", content=BALL, headers=PLAIN, params=settings)  # type: ignore[arg-type]
    assert query.status_code == 422
    assert field in query.json()["detail"]


@pytest.mark.parametrize(
    "rays",
    [
        {},
        {"origins": [[0, 0, 0]]},
        {"origins": [[0, 0]], "directions": [[0, 0, 1]]},
        {"origins": [[0, 0, 0]] * 2, "directions": [[0, 0, 1]] * 3},
        {"origins": [0, 0, 0], "directions": [0, 0, 1], "t_min": [0, 0]},
        {"origins": "north", "directions": [0, 0, 1]},
    ],
)
def test_rays_that_do_not_fit_are_problems(client: TestClient, rays: dict[str, object]) -> None:
    response = client.post("/v1/rays", json={"source": BALL, **rays})
    assert response.status_code == 422
    problem(response, 422, response.json()["type"].rpartition(":")[2])


@pytest.mark.parametrize(
    "arrays",
    [
        {"source": BALL},
        {"origins": [0, 0, 0], "directions": [0, 0, 1]},
        {"source": BALL, "origins": [0, 0, 0], "directions": "up"},
        {"source": BALL, "origins": [[0, 0]], "directions": [0, 0, 1]},
        {"source": BALL, "origins": [0, 0, 0], "directions": [0, 0, 1], "extra": [1]},
    ],
)
def test_archives_that_do_not_fit_are_problems(
    client: TestClient, arrays: dict[str, object]
) -> None:
    response = client.post(
        "/v1/rays", content=archive(**arrays), headers={"Content-Type": "application/x-npz"}
    )
    assert response.status_code == 422
    assert response.json()["detail"]


def test_rays_are_no_plain_text(client: TestClient) -> None:
    response = client.post("/v1/rays", content=BALL, headers=PLAIN)
    problem(response, 415, "unsupported-media-type")


def test_what_is_not_there_or_not_offered_is_a_problem(client: TestClient) -> None:
    problem(client.get("/v2/render"), 404, "http")
    problem(client.get("/v1/render"), 405, "http")
    asked = client.post("/v1/render", content=BALL, headers={**PLAIN, "Accept": "image/webp"})
    assert "image/jpeg" in problem(asked, 406, "not-acceptable")["detail"]


Connect = Callable[[Settings], TestClient]


def test_limits_are_kept(connect: Connect) -> None:
    client = connect(
        Settings(
            max_body_bytes=4000,
            max_text_bytes=2000,
            max_pixels=200,
            max_camera_rays=1000,
            max_rays=3,
        )
    )
    long = BALL + "//" + "-" * 2000
    problem(client.post("/v1/check", content=long, headers=PLAIN), 413, "body-too-large")
    chunks = client.post("/v1/check", content=iter([b"//", b"-" * 2000]), headers=PLAIN)
    problem(chunks, 413, "body-too-large")
    few, many = (np.zeros((count, 3)) for count in (3, 100))
    kind = {"Content-Type": "application/x-npz"}
    within = archive(source=BALL, origins=few, directions=few)
    assert client.post("/v1/rays", content=within, headers=kind).status_code == 200
    beyond = archive(source=BALL, origins=many, directions=many)
    problem(client.post("/v1/rays", content=beyond, headers=kind), 413, "body-too-large")
    assert client.post("/v1/render", content=BALL, headers=PLAIN).status_code == 200
    for query in ("width=100", "samples=10"):
        response = client.post(f"/v1/render?{query}", content=BALL, headers=PLAIN)
        assert "limit" in problem(response, 422, "invalid-settings")["detail"]
    rays = {"source": BALL, "origins": [[0, 0, 3]] * 4, "directions": [0, 0, -1]}
    problem(client.post("/v1/rays", json=rays), 413, "too-many-rays")


@pytest.mark.parametrize(
    "member",
    [
        '"origins": [' + "[]," * 99_999 + "0]",
        '"origins": [' + "{}," * 99_999 + "{}]",
        '"origins": [[0, 0, null]]',
        '"origins": [[0, 0, NaN]]',
        '"t_min": ["' + "1" * 99_999 + '", ' + '"x", ' * 99_999 + "0]",
        '"params": {"a": [' + "[]," * 99_999 + "[]]}",
        '"params": {' + ",".join(f'"{number}": [[]]' for number in range(99_999)) + "}",
        ",".join(f'"{number}": 0' for number in range(99_999)),
        '"x": ' + "[" * 99_999 + "]" * 99_999,
    ],
)
def test_many_faults_in_a_body_are_told_in_a_few_words(client: TestClient, member: str) -> None:
    directions = "" if "directions" in member else ', "directions": [0, 0, 1]'
    origins = "" if "origins" in member else ', "origins": [0, 0, 0]'
    body = f'{{"source": ""{origins}{directions}, {member}}}'
    headers = {"Content-Type": "application/json"}
    response = client.post("/v1/rays", content=body, headers=headers)
    problem(response, 422, "invalid-body")
    assert len(response.content) < 3000


def test_a_misspelt_field_has_a_suggestion(client: TestClient) -> None:
    answer = problem(client.post("/v1/render", json={"widht": 3}), 422, "invalid-body")
    assert answer["detail"] == "there is no field `widht`; did you mean `width`?"


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"Host": "127.0.0.1:8000"}, 200),
        ({"Host": "[::1]:8000"}, 200),
        ({"Host": "LOCALHOST"}, 200),
        ({"Host": "pictures.example:443"}, 200),
        ({"Host": "evil.example:8000"}, 403),
        ({"Host": "127.0.0.1.evil.example"}, 403),
        ({"Host": "[::1"}, 403),
        ({"Origin": "http://localhost:8000"}, 200),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "http://localhost:3000"}, 403),
        ({"Origin": "null"}, 403),
        ({"Host": "evil.example", "Origin": "http://evil.example"}, 403),
    ],
)
def test_pages_of_strangers_are_not_answered(
    connect: Connect, headers: dict[str, str], status: int
) -> None:
    client = connect(Settings(hosts=("Pictures.example",)))
    response = client.post("/v1/check", content=BALL, headers={**PLAIN, **headers})
    assert response.status_code == status
    if status == 403:
        problem(response, 403, "stranger")


def test_a_render_ends_at_its_deadline(client: TestClient) -> None:
    query = "max_seconds=0.2&width=2000&height=2000&samples=200"
    response = client.post(f"/v1/render?{query}", content=BALL, headers=PLAIN)
    assert "max_seconds" in problem(response, 503, "too-slow")["detail"]


def test_scenes_read_no_files_unless_there_is_an_asset_root(
    connect: Connect, client: TestClient, tmp_path: Path
) -> None:
    root = tmp_path / "assets"
    (root / "parts").mkdir(parents=True)
    (root / "parts" / "ball.ovo").write_text("let ball = sphere()\n")
    (tmp_path / "secret.ovo").write_text("let ball = sphere()\n")
    (root / "out").symlink_to(tmp_path / "secret.ovo")
    with_assets = connect(Settings(asset_root=root))

    def codes(client: TestClient, path: object) -> list[str]:
        source = f'use "{path}" as parts\nparts.ball\n'
        answer = client.post("/v1/check", json={"source": source}).json()
        return [fault["code"] for fault in answer["diagnostics"]]

    assert codes(with_assets, "parts/ball.ovo") == []
    assert codes(with_assets, "parts/bell.ovo") == ["file-missing"]
    inside = root / "parts" / "ball.ovo"
    for path in ("../secret.ovo", tmp_path / "secret.ovo", inside, "out", "file:///etc/passwd"):
        assert codes(with_assets, path) == ["file-outside"]
    for path in ("parts/ball.ovo", inside, "/etc/passwd", "../x"):
        assert codes(client, path) == ["file-outside"]
    named = {"source": 'use "passwd" as parts\nparts.ball\n', "name": "../../../../etc/x.ovo"}
    faults = with_assets.post("/v1/check", json=named).json()["diagnostics"]
    assert [fault["code"] for fault in faults] == ["file-outside"]


def test_faults_of_ours_tell_no_secrets(client: TestClient, monkeypatch: Any) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("the secret")

    monkeypatch.setattr("server.routes.scenes.compile_program", broken)
    response = client.post("/v1/check", json={"source": BALL})
    assert "secret" not in response.text
    problem(response, 500, "bug")


def test_the_description_covers_everything(client: TestClient) -> None:
    description = client.get("/openapi.json").json()
    assert description["openapi"].startswith("3.1")
    assert set(description["paths"]) == {"/healthz", "/v1/format", "/v1/rays", *SCENE_PATHS}
    schemas = description["components"]["schemas"]

    def references(value: object) -> set[str]:
        if isinstance(value, dict):
            found = {value["$ref"]} if isinstance(value.get("$ref"), str) else set()
            return found.union(*map(references, value.values()))
        return set().union(*map(references, value)) if isinstance(value, list) else set()

    for reference in references(description):
        assert reference.removeprefix("#/components/schemas/") in schemas, reference
    for path in (*SCENE_PATHS, "/v1/rays"):
        operation = description["paths"][path]["post"]
        assert "application/json" in operation["requestBody"]["content"]
        assert set(operation["responses"]) == {
            *("200", "403", "406", "408", "413", "415", "422", "503")
        }
        for status, response in operation["responses"].items():
            assert ("application/problem+json" in response["content"]) == (status != "200")


def test_parameters_are_set_by_body_and_query(client: TestClient) -> None:
    source = "param n = 3 in 1..9\nparam tilt = 1deg\nfor i in 0..n { sphere().rotate_x(tilt) }"
    body = {"source": source, "params": {"n": 5, "tilt": "30deg"}}
    answer = client.post("/v1/compile", json=body).json()
    assert answer["leaves"] == 5
    assert [param["value"] for param in answer["params"]] == [5, "30deg"]
    query = "/v1/compile?params.n=7&params.tilt=2deg"
    assert client.post(query, content=source, headers=PLAIN).json()["leaves"] == 7
    response = client.post("/v1/compile?params.n=10", content=source, headers=PLAIN)
    assert "value-out-of-range" in problem(response, 422, "scene-faults")["rendered"]
