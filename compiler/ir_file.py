"""A file that holds an IR, as text or in the binary form."""

from __future__ import annotations

from pathlib import Path

from compiler.ir import SceneIR
from compiler.ir_binary import is_binary, read_ir
from compiler.ir_parse import parse_ir
from dsl.diagnostics import CompileError
from dsl.files import FileFault, Files


def read_ir_file(path: Path) -> SceneIR:
    """The IR of a file, whichever form it has; raises CompileError where there is none."""
    files = Files()
    try:
        if is_binary(files.resolve(str(path))):
            return read_ir(path)
        return parse_ir(files.read_text(str(path)), str(path))
    except FileFault as fault:
        raise CompileError([fault.diagnostic(None)]) from None
