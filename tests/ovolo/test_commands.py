"""The command line: what each command says, and how it ends."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest

from ovolo.__main__ import COMMANDS, main
from ovolo.exits import Exit

BALL = "sphere()\nsettings(width: 16, height: 12, samples: 1)\n"
FAULTY = "spher()\n"
WARNING = "sphere()\nsphere().scale(0)\n"
STAGE = '#usda 1.0\ndef Sphere "Ball" {\n    double radius.timeSamples = { 1: 1, 5: 2 }\n}\n'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with some scenes."""
    for name, content in (
        ("ball.ovo", BALL),
        ("faulty.ovo", FAULTY),
        ("warning.ovo", WARNING),
        ("stage.usda", STAGE),
    ):
        (tmp_path / name).write_text(content)
    (tmp_path / "binary.ovo").write_bytes(bytes(range(256)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


class Outcome:
    """What a command left behind."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def json(self) -> Any:
        return json.loads(self.out)


Run = Any


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command in this process; no traceback may come out."""

    def run(*arguments: str) -> Outcome:
        code = main(arguments)
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return Outcome(code, out, err)

    return run


def test_check_is_silent_about_sound_scenes(run: Run) -> None:
    outcome = run("check", "ball.ovo", "stage.usda")
    assert (outcome.code, outcome.out, outcome.err) == (Exit.OK, "", "")


def test_check_reports_the_faults_of_all_scenes(run: Run) -> None:
    outcome = run("check", "faulty.ovo", "ball.ovo", "warning.ovo", "missing.ovo")
    assert outcome.code == Exit.FAULTS
    assert outcome.out == ""
    assert "error[name-unknown]: " in outcome.err
    assert " --> faulty.ovo:1:1\n" in outcome.err
    assert "warning[scene-singular-transform]: " in outcome.err
    assert "error[file-missing]: " in outcome.err
    assert outcome.err.endswith("2 errors, 1 warning\n")


def test_warnings_alone_are_no_failure(run: Run) -> None:
    outcome = run("check", "warning.ovo")
    assert outcome.code == Exit.OK
    assert outcome.err.endswith("1 warning\n")


def test_check_answers_programs_in_json(run: Run) -> None:
    assert run("check", "--json", "ball.ovo").json == {"ok": True, "diagnostics": []}
    outcome = run("check", "--json", "faulty.ovo", "warning.ovo")
    assert (outcome.code, outcome.err) == (Exit.FAULTS, "")
    assert outcome.json["ok"] is False
    codes = [fault["code"] for fault in outcome.json["diagnostics"]]
    assert codes == ["name-unknown", "scene-singular-transform"]


def test_a_program_has_the_time_that_is_said(run: Run, folder: Path) -> None:
    (folder / "clock.ovo").write_text("sphere(radius: 1 + time)\n")
    assert "radius 3.5\n" in run("compile", "clock.ovo", "--time", "2.5").out
    assert "radius 1\n" in run("compile", "clock.ovo").out


def test_a_program_has_the_parameters_that_are_set(run: Run, folder: Path) -> None:
    (folder / "param.ovo").write_text("param r = 1 in 1..9\nsphere(radius: r)\n")
    for command in ("compile", "inspect"):
        assert run(command, "param.ovo", "--set", "r=2", "--json").json["params"][0]["value"] == 2
    assert "r = 2.0" in run("inspect", "param.ovo", "--set", "r=2").out
    for command in ("check", "compile", "inspect", "render"):
        outcome = run(command, "param.ovo", "--set", "r=20")
        assert outcome.code == Exit.FAULTS
        assert "value-out-of-range" in outcome.err
        assert run(command, "stage.usda", "--set", "r=20").code == Exit.FAULTS
    assert run("check", "param.ovo", "--set", "r").code == Exit.USAGE


def test_fmt_rewrites_what_is_not_canonical(run: Run, folder: Path) -> None:
    (folder / "loose.ovo").write_bytes(b"sphere( 1 )  // one\r\n")
    outcome = run("fmt", "--check", "loose.ovo", "ball.ovo")
    assert outcome.code == Exit.FAULTS
    assert outcome.err == "loose.ovo is not in its canonical form\n"
    outcome = run("fmt", "--diff", "loose.ovo")
    assert outcome.code == Exit.OK
    assert "+sphere(1)  // one\n" in outcome.out
    assert run("fmt", "loose.ovo", "ball.ovo").code == Exit.OK
    assert (folder / "loose.ovo").read_bytes() == b"sphere(1)  // one\n"
    assert run("fmt", "--check", "loose.ovo").code == Exit.OK


def test_fmt_leaves_faulty_programs_alone(run: Run, folder: Path) -> None:
    (folder / "open.ovo").write_text("sphere( 1\n")
    outcome = run("fmt", "open.ovo", "missing.ovo")
    assert outcome.code == Exit.FAULTS
    assert "error[syntax-unclosed]" in outcome.err
    assert "error[file-missing]" in outcome.err
    assert (folder / "open.ovo").read_text() == "sphere( 1\n"


@pytest.mark.parametrize("command", ["check", "fmt", "doc"])
def test_a_program_beyond_the_limit_is_refused(run: Run, folder: Path, command: str) -> None:
    (folder / "large.ovo").write_bytes(b"\n" * 8_000_001)
    outcome = run(command, "large.ovo")
    assert outcome.code == Exit.FAULTS
    assert "`large.ovo` has 8000001 bytes, more than the limit of 8000000" in outcome.err


def test_fmt_filters_standard_input(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def given(content: bytes) -> None:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content)))

    given(b"\xef\xbb\xbfsphere( 1 )")
    assert run("fmt", "-").out == "sphere(1)\n"
    given(b"sphere() // \xff")
    outcome = run("fmt", "-")
    assert (outcome.code, outcome.out) == (Exit.FILES, "")
    assert outcome.err.startswith("error[file-encoding]: `standard input` is not UTF-8")


@pytest.mark.parametrize(
    "name", ["missing.ovo", "missing.usdc", ".", "binary.ovo", "no/such/folder.ovo", "nul\0l.ovo"]
)
@pytest.mark.parametrize("command", ["check", "render", "compile", "inspect"])
def test_a_file_that_cannot_be_read_is_told(run: Run, command: str, name: str) -> None:
    outcome = run(command, name)
    assert outcome.code == Exit.FILES
    assert outcome.err.startswith("error[file-")


def test_a_file_that_a_scene_names_is_a_fault_of_the_scene(run: Run, folder: Path) -> None:
    (folder / "user.ovo").write_text('use "missing.ovo" as m\nsphere()\n')
    outcome = run("check", "user.ovo")
    assert outcome.code == Exit.FAULTS
    assert "error[file-missing]" in outcome.err


@pytest.mark.parametrize("command", ["render", "compile", "inspect"])
def test_every_command_tells_the_faults_of_a_scene(run: Run, command: str) -> None:
    outcome = run(command, "faulty.ovo")
    assert (outcome.code, outcome.out) == (Exit.FAULTS, "")
    assert outcome.err.startswith("error[name-unknown]: ")
    outcome = run(command, "faulty.ovo", "--json")
    assert outcome.code == Exit.FAULTS
    assert outcome.json["diagnostics"][0]["code"] == "name-unknown"


def test_render_writes_a_picture_and_says_where(run: Run, folder: Path) -> None:
    outcome = run("render", "ball.ovo")
    assert outcome.code == Exit.OK
    assert outcome.out.startswith("ball.png: 16 × 12 pixels, 1 spp, ")
    assert "Mrays/s" in outcome.out
    assert outcome.err == ""
    assert (folder / "ball.png").read_bytes().startswith(b"\x89PNG")


PRODUCT = """#usda 1.0
( renderSettingsPrimPath = "/Render/s" )
def "Render" {
    def RenderSettings "s" {
        rel products = </Render/p>
        uniform int2 resolution = (8, 8)
    }
    def RenderProduct "p" {
        token productName = "%s"
    }
}
def Sphere "Ball" {
}
"""


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("beauty.png", "beauty.png"),
        ("pictures/beauty.png", "shot.png"),  # there is no such folder
        ("../beauty.png", "shot.png"),
        ("beauty.txt", "shot.png"),
    ],
)
def test_a_stage_says_what_its_picture_is_called(
    run: Run, folder: Path, name: str, written: str
) -> None:
    (folder / "shot.usda").write_text(PRODUCT % name)
    assert run("render", "shot.usda", "--samples=1", "--quiet").code == Exit.OK
    assert [path.name for path in folder.glob("*.png")] == [written]
    assert not (folder.parent / "beauty.png").exists()
    assert run("render", "shot.usda", "-oother.png", "--samples=1", "--quiet").code == Exit.OK
    assert (folder / "other.png").exists()


def test_what_is_missing_is_said_once(run: Run, folder: Path) -> None:
    (folder / "cloth.usda").write_text("""#usda 1.0
def Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </m>
}
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @cloth.png@
        float3 outputs:rgb
    }
}
""")
    outcome = run("render", "cloth.usda", "--samples=1", "--width=8")
    assert (outcome.out + outcome.err).count("cloth.png` cannot be found") == 1


def test_frames_are_pictures_of_several_times(run: Run, folder: Path) -> None:
    (folder / "moving.ovo").write_text("sphere(radius: 1 + time)\nsettings(width: 8, height: 8)\n")
    words = ("moving.ovo", "--frames", "0:4x2", "-o", "f.##.png", "--quiet", "--json")
    figures = run("render", *words).json
    assert [frame["time"] for frame in figures] == [0, 2, 4]
    assert [frame["outputs"] for frame in figures] == [["f.00.png"], ["f.02.png"], ["f.04.png"]]
    assert run("render", "stage.usda", "--frames", "1,5", "--quiet").code == Exit.OK
    assert (folder / "stage.0005.png").exists()
    assert run("render", "moving.ovo", "--frames", "1:2", "--time", "1").code == Exit.USAGE
    assert run("render", "moving.ovo", "--frames", "2:1x1").code == Exit.USAGE


def test_render_writes_several_pictures_of_one_film(run: Run, folder: Path) -> None:
    outcome = run(
        *("render", "ball.ovo", "-o", "a.exr", "-o", "b.jpg", "--width", "8", "--height", "6"),
        *("--samples", "2", "--integrator", "normals", "--precision", "float64", "--seed", "3"),
        *("--threads", "1", "--json"),
    )
    assert outcome.code == Exit.OK, outcome.err
    answer = outcome.json
    assert answer["outputs"] == ["a.exr", "b.jpg"]
    assert (answer["width"], answer["height"], answer["samples"]) == (8, 6, 2)
    assert answer["rays"] >= 8 * 6 * 2
    assert 0 < answer["render_seconds"] <= answer["seconds"]
    assert (folder / "a.exr").stat().st_size > 100
    assert (folder / "b.jpg").stat().st_size > 100


def test_quiet_says_nothing(run: Run) -> None:
    outcome = run("render", "warning.ovo", "--width", "4", "--height", "4", "--quiet")
    assert (outcome.code, outcome.out, outcome.err) == (Exit.OK, "", "")


@pytest.mark.parametrize("time", ["1", "2.5", "earliest", "-3"])
def test_a_stage_has_a_time(run: Run, time: str) -> None:
    assert run("compile", "stage.usda", "--emit", "ir", f"--time={time}").code == Exit.OK


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--width", "0"], "width"),
        (["--width", "4", "--height", "1000000"], "height"),
        (["--width", "60000", "--height", "60000"], "limit"),
        (["--samples", "-1"], "samples"),
        (["--camera", "side"], "side"),
        (["--threads", "-1"], "threads"),
        (["--seed", "-1"], "seed"),
        (["--integrator", "magic"], "integrator"),
        (["--precision", "float16"], "precision"),
        (["--width", "wide"], "width"),
        (["--time", "nan"], "time"),
        (["--colour"], "--colour"),
    ],
)
def test_settings_that_cannot_be_are_usage_errors(
    run: Run, arguments: list[str], words: str
) -> None:
    outcome = run("render", "ball.ovo", *arguments)
    assert (outcome.code, outcome.out) == (Exit.USAGE, "")
    assert words in outcome.err


@pytest.mark.parametrize("output", ["a.bmp", "a", "no/such/folder/a.png", ".", "a.png/b.png"])
def test_an_output_that_cannot_be_is_told_before_rendering(
    run: Run, folder: Path, output: str
) -> None:
    (folder / "a.png").write_text("")
    outcome = run("render", "missing.ovo", "-o", output)
    assert outcome.code == Exit.FILES
    assert outcome.err.startswith("error: ")


def test_compile_prints_the_text_form(run: Run, folder: Path) -> None:
    outcome = run("compile", "ball.ovo", "--emit", "ir")
    assert (outcome.code, outcome.err) == (Exit.OK, "")
    assert outcome.out.startswith("ovolo ir 1\n")
    assert run("compile", "ball.ovo", "--emit", "ir", "-o", "ball.ir").code == Exit.OK
    assert (folder / "ball.ir").read_text() == outcome.out


def test_compile_writes_the_binary_form(run: Run, folder: Path) -> None:
    from compiler.ir_binary import read_ir
    from compiler.ir_text import print_ir

    assert run("compile", "ball.ovo", "--emit", "binary", "-o", "ball.ir").code == Exit.OK
    assert print_ir(read_ir(folder / "ball.ir")) == run("compile", "ball.ovo", "--emit=ir").out


def test_the_binary_form_is_not_for_a_terminal(run: Run) -> None:
    outcome = run("compile", "ball.ovo", "--emit", "binary")
    assert (outcome.code, outcome.out) == (Exit.USAGE, "")
    assert "= help: add `--output PATH`" in outcome.err


@pytest.mark.parametrize("form", ["ir", "binary"])
@pytest.mark.parametrize("output", ["no/such/folder/a.ir", "."])
def test_an_ir_that_cannot_be_written_is_told(run: Run, form: str, output: str) -> None:
    outcome = run("compile", "ball.ovo", "--emit", form, "-o", output)
    assert outcome.code == Exit.FILES
    assert "cannot be written" in outcome.err


@pytest.mark.parametrize("command", ["compile", "inspect"])
def test_a_scene_is_told_in_figures(run: Run, command: str) -> None:
    outcome = run(command, "warning.ovo", "--json")
    assert (outcome.code, outcome.err) == (Exit.OK, "")
    assert (outcome.json["leaves"], outcome.json["prototypes"]) == (1, {"sphere": 1})
    assert outcome.json["bounds"] == [[-1, -1, -1], [1, 1, 1]]
    assert outcome.json["pruned"]["singular_instances"] == 1
    assert len(outcome.json["hash"]) == 64


def test_inspect_tells_figures_and_what_is_left_out(run: Run) -> None:
    outcome = run("inspect", "warning.ovo")
    lines = dict(line.split(maxsplit=1) for line in outcome.out.splitlines())
    assert lines["instances"] == "1"
    assert lines["prototypes"] == "1 sphere"
    assert lines["lights"] == "none"
    assert lines["bounds"] == "(-1, -1, -1) … (1, 1, 1)"
    assert "1 singular instances" in outcome.out
    assert "warning[scene-singular-transform]" in outcome.err


def test_inspect_tells_what_was_dropped_from_a_stage(run: Run, folder: Path) -> None:
    (folder / "odd.usda").write_text('#usda 1.0\ndef Volume "Odd" {\n}\ndef Cube "C" {\n}\n')
    outcome = run("inspect", "odd.usda", "--json")
    (dropped,) = outcome.json["diagnostics"]
    assert dropped["primary"]["prim"] == "/Odd"


def test_versions_are_told(run: Run) -> None:
    import ovolo

    assert run("version").out.startswith(f"ovolo {ovolo.__version__}\n")
    answer = run("version", "--json").json
    assert answer["ovolo"] == ovolo.__version__
    assert answer["instruction_sets"][-1] == "portable"
    assert run("--version").out == f"ovolo {ovolo.__version__}\n"


def test_help_names_commands_and_exit_codes(run: Run) -> None:
    outcome = run("--help")
    assert outcome.code == Exit.OK
    for name in COMMANDS:
        assert f"\n    {name}" in outcome.out
        assert run(name, "--help").code == Exit.OK
    for code in Exit:
        assert f"  {code.value:<4} {code.meaning}" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "message", "help"),
    [
        (["rendr"], "there is no command `rendr`", "did you mean `render`?"),
        (["xyz"], "there is no command `xyz`", "`ovolo --help` lists the commands"),
        (["--colour"], "the following arguments are required: COMMAND", "`ovolo --help` lists "),
        (["check"], "the following arguments are required: SCENE", "`ovolo check --help` lists "),
        (
            ["render", "a.ovo", "--sam", "1"],
            "there is no argument `--sam`",
            "`ovolo render --help` ",
        ),
        (["render", "a.ovo", "--frames", "3:a"], "argument --frames: `a` is no frame", "`ovolo "),
        (["render", "a.ovo", "--time", "now"], "argument --time: `now` is not a time", "`ovolo "),
        (["render", "a.ovo", "--memory", "0"], "argument --memory: `0` is not a num", "`ovolo "),
        (["export", "a", "b", "--tolerance", "1"], "argument --tolerance: `1` is not", "`ovolo "),
        (["serve", "--port", "99999"], "argument --port: `99999` is not a port", "`ovolo serve "),
    ],
)
def test_what_cannot_be_understood_is_told_in_two_lines(
    run: Run, arguments: list[str], message: str, help: str
) -> None:
    outcome = run(*arguments)
    assert (outcome.code, outcome.out) == (Exit.USAGE, "")
    said, mend = outcome.err.splitlines()
    assert said.startswith(f"error: {message}")
    assert mend.startswith(f"  = help: {help}")


def test_without_a_command_the_commands_are_listed(run: Run) -> None:
    outcome = run()
    assert (outcome.code, outcome.out) == (Exit.USAGE, "")
    assert all(f"\n    {name}" in outcome.err for name in COMMANDS)


def test_help_keeps_names_as_they_are_written(run: Run) -> None:
    assert "Turn a scene into a USD stage." in run("export", "--help").out


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "example.com"])
def test_serve_listens_to_this_machine_alone(run: Run, host: str) -> None:
    outcome = run("serve", "--host", host)
    assert outcome.code == Exit.USAGE
    assert "loopback" in outcome.err


def test_serve_says_what_it_cannot_have(run: Run) -> None:
    assert run("serve", "--assets", "no/such/folder").code == Exit.FILES
    assert run("serve", "--port", "99999").code == Exit.USAGE


def test_interrupting_ends_with_a_word(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("compiler.compilation.compile_path", interrupted)
    outcome = run("check", "ball.ovo")
    assert (outcome.code, outcome.err) == (Exit.INTERRUPTED, "interrupted\n")


def test_a_fault_of_ours_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("compiler.compilation.compile_path", broken)
    assert main(["check", "ball.ovo"]) == Exit.BUG
    assert "ovolo's own" in capsys.readouterr().err
