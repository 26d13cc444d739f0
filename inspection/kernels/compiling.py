"""Compiling with numba: when and with which options, the instructions that Python has no words for, and who is told of it.

Nothing is compiled at import; the first call of a kernel does it.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeVar, cast

from llvmlite import ir
from numba import carray, njit, typeof, types
from numba.core import cgutils, config
from numba.core.caching import FunctionCache
from numba.core.event import Event, Listener, register
from numba.core.runtime import rtsys
from numba.extending import intrinsic

from inspection.kernels.cache_folder import places_for, stamp_of, stamped_folder
from inspection.kernels.compile_notice import begin_to_compile
from inspection.kernels.layout import BLOCK, CHUNK, INTEGERS, REALS

_Function = TypeVar("_Function", bound=Callable[..., Any])
array_at = carray  # the array of a size that begins at a place in memory, without a copy
type_of = typeof  # what the compiler calls the type of a value


def tuple_of(*parts: types.Type) -> types.Type:
    """The type of a tuple of such values."""
    return types.Tuple(parts)


_HERE = Path(__file__).parent
_WIDEST = '"prefer-vector-width"="512"'

REAL, INTEGER, SHORT, CODE, MARK, TRUTH = types.float64, types.int64, types.int32, types.int8, types.uint8, types.boolean
REAL_ARRAY, INTEGER_ARRAY, MARK_ARRAY = REAL[::1], INTEGER[::1], MARK[::1]  # that is written to
REAL_TABLE, INTEGER_TABLE, SHORT_TABLE = (types.Array(of, 1, "C", readonly=True) for of in (REAL, INTEGER, SHORT))


class _KeptCode(FunctionCache):  # type: ignore[misc]  # numba has no types
    """What is kept on disk of a function, loaded without what compiles.

    numba would first load everything that any function might be compiled with: a tenth of the time of a short command. It does so as
    well before it compiles.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for arguments of these types; None where there is none yet."""
        rtsys.initialize(target_context)  # compiled code calls it for arrays
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def kernel(function: _Function, **options: bool) -> _Function:
    """Compile on the first call and keep the result on disk; where nothing can be written, compile in every process."""
    options = {"nogil": True, "no_cfunc_wrapper": True} | options
    compiled = njit(error_model="numpy", **options)(function)
    try:
        with _code_kept_in_stamped_folder(Path(function.__code__.co_filename).parent):
            kept = _KeptCode(function)
    except RuntimeError:
        return cast(_Function, compiled)
    compiled._cache = kept
    return cast(_Function, compiled)


def brief_kernel(function: _Function) -> _Function:
    """Compile what takes a few microseconds: it keeps the interpreter. To have that again may take milliseconds beside another thread."""
    return kernel(function, nogil=False)


def inner_kernel(function: _Function, **options: bool) -> _Function:
    """Compile for other kernels alone. Python must not call it: the wrapper for that, which takes longer to compile, is left out."""
    return kernel(function, no_cpython_wrapper=True, **options)


def inlined_kernel(function: _Function) -> _Function:
    """Compile for other kernels alone, with forced inlining, so that loops calling it vectorise."""
    return inner_kernel(function, forceinline=True)


def uncounted_kernel(function: _Function, **options: bool) -> _Function:
    """Compile for other kernels alone, where arrays are handed on without counting who holds them: counting takes as long as the work.

    It must not make arrays, nor return any.
    """
    return inner_kernel(function, _nrt=False, **options)


def inlined_uncounted_kernel(function: _Function) -> _Function:
    """The same with forced inlining."""
    return uncounted_kernel(function, forceinline=True)


def code_of(function: Callable[..., None], *given: types.Type) -> int:
    """Where in memory the code of a kernel is for arguments of these types. It is compiled, or loaded, where that was not done yet."""
    code, described = attrgetter("library", "fndesc")(cast(Any, function).get_compile_result(types.void(*given)))
    return int(code.get_pointer_to_function(described.llvm_func_name))


def call_of(*wanted: types.Type) -> Any:
    """An instruction that calls the code at a place in memory, see `code_of`, with arguments of these types.

    A kernel that is called by its name becomes part of its caller, and is optimised anew with each one; by its place it is compiled
    once.
    """

    @instructions
    def call(typing_context: Any, place: Any, given: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            convention = context.call_conv
            code = builder.inttoptr(args[0], convention.get_function_type(types.void, wanted).as_pointer())
            status, _ = convention.call_function(builder, code, types.void, wanted, cgutils.unpack_tuple(builder, args[1], len(wanted)))
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return context.get_dummy_value()

        return types.void(types.int64, types.Tuple(wanted)), generate

    return call


def memory_of(kind: types.Type) -> Any:
    """An instruction that takes a number for the place in memory of values of a type, of which `array_at` makes an array.

    To hand an array to a compiled loop takes 0.1 us, and a number next to nothing.
    """

    @instructions
    def memory(typing_context: Any, place: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(signature.return_type))

        return types.CPointer(kind)(types.int64), generate

    return memory


@contextmanager
def _code_kept_in_stamped_folder(package: Path) -> Iterator[None]:
    """Let numba keep what is decorated meanwhile in the folder of its package's stamp. Raises RuntimeError where there is none.

    package : this one, or one within it
    """
    package = package if package.parent == _HERE else _HERE
    stamp, chosen = _stamp(package), config.CACHE_DIR
    if not stamp:  # in an archive: numba's own stamp is that of the whole archive
        yield
        return
    folder = _folder(package, stamp, chosen)
    if folder is None:
        raise RuntimeError("no folder for compiled code can be written")
    config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = chosen


def compiled_code_folder() -> Path | None:
    """Where compiled code is kept from one process to the next; None where it is not, and every process compiles anew."""
    return _folder(_HERE, _stamp(_HERE), config.CACHE_DIR) if _stamp(_HERE) else None


@cache
def _stamp(package: Path) -> str:
    return stamp_of(*dict.fromkeys((_HERE, package)))


@cache
def _folder(package: Path, stamp: str, chosen: str) -> Path | None:
    return stamped_folder(stamp, places_for(package, chosen))


def instructions(function: Callable[..., Any]) -> Any:
    """Mark a function that emits LLVM instructions itself."""
    return intrinsic(function)


@instructions
def fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """The value a b + c with one rounding, in single precision where all three are."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    kind = types.float32 if a == b == c == types.float32 else types.float64
    return kind(kind, kind, kind), generate


@instructions
def bits_of(typing_context: Any, value: Any) -> Any:
    """The bits of a real of single precision as a whole number, which rises with it where it is not negative."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(32))

    return types.int32(types.float32), generate


def _prefer_widest(builder: Any) -> None:
    set.add(builder.function.attributes, _WIDEST)  # by the set that it is, since llvmlite knows no attributes that are texts


@instructions
def as_wide_as_can_be(typing_context: Any) -> Any:
    """Vectorise the loops of this function as wide as the processor can."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        _prefer_widest(builder)
        return context.get_dummy_value()

    return types.void(), generate


@instructions
def stack_reals(typing_context: Any) -> Any:
    """Memory for REALS numbers on the stack. The compiler knows that it overlaps no table, and vectorises loops that read both.

    It does so as wide as the processor can: for some it would otherwise take half the width, which spills and takes 12 to 20 % longer.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        _prefer_widest(builder)
        place = _stack_memory(builder, ir.DoubleType(), REALS)
        place.align = 64
        return builder.bitcast(place, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(), generate


@instructions
def stack_integers(typing_context: Any) -> Any:
    """Memory for INTEGERS integers on the stack."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = _stack_memory(builder, ir.IntType(64), INTEGERS)
        return builder.bitcast(place, ir.IntType(64).as_pointer())

    return types.CPointer(types.int64)(), generate


def _stack_memory(builder: Any, kind: Any, count: int) -> Any:
    """Memory for so many values, which are not set: numba's own words would set them to zero at every call, which takes 0.7 us."""
    with builder.goto_entry_block():
        return builder.alloca(ir.ArrayType(kind, count))


@instructions
def rows_to_columns(typing_context: Any, table: Any, rows: Any, first: Any, target: Any, place: Any) -> Any:
    """Turn eight rows of eight numbers of a table into eight columns: target[place + q BLOCK + i] = table[rows[first + i] + q].

    Whole rows are loaded and transposed in registers, which takes a third of the time of gathering single numbers.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        eight = ir.VectorType(ir.DoubleType(), 8)
        table_data, rows_data, target_data = (context.make_array(signature.args[i])(context, builder, args[i]).data for i in (0, 1, 3))
        word = ir.IntType(64)

        def at(data: Any, offset: Any) -> Any:
            return builder.gep(data, [offset], inbounds=True)

        lines = []
        for i in range(8):
            row = builder.load(at(rows_data, builder.add(args[2], word(i))))
            lines.append(builder.load(builder.bitcast(at(table_data, row), eight.as_pointer()), align=8))
        choice = ir.VectorType(ir.IntType(32), 8)
        for span in (4, 2, 1):
            low = ir.Constant(choice, [i + (8 - span if i & span else 0) for i in range(8)])
            high = ir.Constant(choice, [i + (8 if i & span else span) for i in range(8)])
            for i in range(8):
                if not i & span:
                    a, b = lines[i], lines[i + span]
                    lines[i], lines[i + span] = builder.shuffle_vector(a, b, low), builder.shuffle_vector(a, b, high)
        for q in range(8):
            offset = builder.add(args[4], word(q * BLOCK))
            builder.store(lines[q], builder.bitcast(at(target_data, offset), eight.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(table, rows, types.int64, target, types.int64), generate


@instructions
def claim_chunk(typing_context: Any, claimed: Any) -> Any:
    """Claim the next chunk of points, which no other thread then gets. Returns its first point."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        counter = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.atomic_rmw("add", counter, ir.Constant(ir.IntType(64), CHUNK), "monotonic")

    return types.int64(claimed), generate


class _Notice(Listener):  # type: ignore[misc]  # numba has no types
    def on_start(self, event: Event) -> None:
        begin_to_compile()

    def on_end(self, event: Event) -> None:
        """Nothing to tell."""


register("numba:compile", _Notice())  # at import, because who waits to be told has long said so
