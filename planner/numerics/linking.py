"""How compiled functions are put together: optimised once, in what Python calls.

Numba compiles each function that another one calls on its own first: it is optimised,
made into machine code, wrapped for Python and saved, and all of it is optimised again
in each caller. Here a called function, a part, goes only as far as LLVM's language. The
function that Python calls, the entry, is linked from its parts, optimised and made into
machine code once. A part that Python calls too is compiled as an entry of its own then.
Only counts of references are deleted before parts are linked: in small functions it can
be seen that nobody needs them.
Floating point is the same either way, as LLVM reorders none of it.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from llvmlite import binding as llvm  # type: ignore[import-untyped]
from numba.core import compiler, event, sigutils, types, typing
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.dispatcher import (  # type: ignore[attr-defined]  # private to it
    _FunctionCompiler,
)
from numba.core.environment import lookup_environment
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering, register_pass
from numba.extending import overload
from numba.np import arrayobj

_ENVIRONMENT = "_ZN08NumbaEnv"  # how the names of constants that a function needs begin
_FUNCTION = re.compile(r"(?m)^(?=define)|(?<=^}\n)")
_ARGUMENT = re.compile(r"%(?:\"arg\.[^\"]*\"|arg\.[\w.$-]*)")
_COUNT = re.compile(rf"call void @NRT_(?:inc|dec)ref\(ptr ({_ARGUMENT.pattern})\)")
_CALL = re.compile(r"^ *(?:%\S+ = )?(?:tail )?call [^@]*@")
_RUNTIME = "NRT_"  # numba's count of references, whose calls a pass looks for


class _BorrowingLibrary(JITCodeLibrary):  # type: ignore[misc]  # numba has no types
    """Code that does not count references to what its caller holds anyway."""

    def add_llvm_module(self, ll_module: Any) -> None:
        """Optimise the functions of a module and add them."""
        self._optimize_functions(ll_module)
        text = _without_counts_of_arguments(str(ll_module))
        self._final_module.link_in(llvm.parse_assembly(text))


class _PartLibrary(_BorrowingLibrary):
    """The code of one part as it was lowered, without the parts that it calls."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self._whole: Any = None

    def finalize(self) -> None:
        """Close the library: neither optimised nor made into machine code."""
        self._raise_if_finalized()
        self._final_module.verify()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "external":
                function.linkage = "linkonce_odr"
        self._finalized = True

    def own_module(self) -> Any:
        """Return the module of this part alone."""
        return self._final_module

    def _get_module_for_linking(self) -> Any:
        """Return one module of the part and all that it calls, as numba expects it."""
        if self._whole is None:
            self._whole = self._final_module.clone()
            _link_parts(self, self._whole)
        return self._whole


class EntryLibrary(_BorrowingLibrary):
    """The code of an entry and of all its parts."""

    def finalize(self) -> None:
        """Link all parts, optimise once, and make machine code."""
        self._raise_if_finalized()
        own = {
            function.name
            for function in self._final_module.functions
            if not function.is_declaration
        }
        _link_parts(self, self._final_module)
        for function in self._final_module.functions:
            if (
                not function.is_declaration
                and function.name not in own
                and not function.name.startswith(_RUNTIME)
            ):
                function.linkage = "internal"  # a part is dropped once it is inlined
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()

    def object_and_symbols(self) -> tuple[bytes, tuple[str, ...]]:
        """Return the machine code and the names that it defines."""
        module = self._final_module
        named = (*module.functions, *module.global_variables)
        symbols = tuple(each.name for each in named if not each.is_declaration)
        return self._get_compiled_object(), symbols

    @classmethod
    def from_object(
        cls, codegen: Any, name: str, code: bytes, symbols: tuple[str, ...]
    ) -> "EntryLibrary":
        """Make a library of machine code; nothing else can be linked with it."""
        library = cls(codegen, name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols.update(symbols)
        return library


def _without_counts_of_arguments(text: str) -> str:
    """Delete the counting of references to arguments that do not escape.

    Numba counts a reference wherever an argument is bound to a name, and each field of
    a named tuple wherever it is read, with an atomic instruction. Its own pass deletes
    pairs of these only where it sees both on every way through the function. But the
    caller holds the argument until the call ends. So where a function does nothing with
    it but count and hand it on to other functions, which only borrow it as well, all
    counts of it cancel out.

    Args:
        text: A module in LLVM's language, its functions optimised: arguments do not
            stand in memory any more.
    """
    functions = _FUNCTION.split(text)
    return "".join(
        _without_counts(each) if each.startswith("define") else each
        for each in functions
    )


def _without_counts(function: str) -> str:
    """Delete the counts of one function."""
    head, *body = function.splitlines(keepends=True)
    arguments = set(_ARGUMENT.findall(head))
    counted = {found[1] for line in body if (found := _COUNT.search(line))} & arguments
    for line in body:
        # A count that is written in another way would be kept without its opposite.
        unread = _RUNTIME in line and _COUNT.search(line) is None
        if counted and (unread or _CALL.search(line) is None):
            counted.difference_update(_ARGUMENT.findall(line))
    return head + "".join(
        line
        for line in body
        if (found := _COUNT.search(line)) is None or found[1] not in counted
    )


def _link_parts(library: Any, module: Any) -> None:
    """Link everything that a library calls, directly or not, into a module."""
    found: dict[int, Any] = {}
    waiting = list(library._linking_libraries)
    while waiting:
        part = waiting.pop(0)
        if id(part) in found:
            continue
        found[id(part)] = part
        library._reload_init.update(part._reload_init)
        if isinstance(part, _PartLibrary):
            waiting.extend(part._linking_libraries)
            module.link_in(part.own_module(), preserve=True)
        else:
            module.link_in(part._get_module_for_linking(), preserve=True)


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):  # type: ignore[misc]  # numba has no types
    """Lowers a part into a library that is not optimised."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower."""
        codegen = state.targetctx.codegen()
        state.library = _PartLibrary(codegen, state.func_id.func_qualname)
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class _EntryLowering(NativeLowering):  # type: ignore[misc]  # numba has no types
    """Lowers an entry and links its parts."""

    _name = "entry_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower, and hand the constants of all parts to the machine code."""
        codegen = state.targetctx.codegen()
        state.library = EntryLibrary(codegen, state.func_id.func_qualname)
        state.library.enable_object_caching()
        done = super().run_pass(state)
        for variable in state.library._final_module.global_variables:
            if variable.name.startswith(_ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    codegen.set_env(variable.name, environment)
        return bool(done)


def _pipeline(state: Any, lowering: type) -> list[PassManager]:
    """Return numba's passes with another one for lowering."""
    usual = compiler.DefaultPassBuilder.define_nopython_pipeline(state)
    passes = PassManager(lowering.__name__)
    passes.passes.extend(
        (lowering if each is NativeLowering else each, what)
        for each, what in usual.passes
    )
    passes.finalize()
    return [passes]


class _PartCompiler(compiler.CompilerBase):  # type: ignore[misc]  # numba has no types
    """Compiles a part."""

    def define_pipelines(self) -> list[PassManager]:
        """Return the passes."""
        return _pipeline(self.state, _PartLowering)


class _EntryCompiler(compiler.CompilerBase):  # type: ignore[misc]  # numba has no types
    """Compiles an entry."""

    def define_pipelines(self) -> list[PassManager]:
        """Return the passes."""
        return _pipeline(self.state, _EntryLowering)


class _Flags(compiler.Flags):  # type: ignore[misc]  # numba has no types
    """Numba's flags: keys of its tables, compared 50,000 times to compile a family."""

    __slots__ = ()

    def __hash__(self) -> int:
        """Return the hash of the base class, which is that of the options' names."""
        return _FLAGS_HASH

    def __eq__(self, other: object) -> bool:
        """Compare what is set, and only then what is left to its default."""
        if isinstance(other, compiler.Flags) and self._values == other._values:
            return True
        return bool(super().__eq__(other))


_FLAGS_HASH = hash(compiler.Flags())


def _wrong_shape(source: object, target: object) -> None:
    """Stand in for numba's function that raises if slices differ in shape."""
    raise NotImplementedError


@overload(_wrong_shape)  # type: ignore[untyped-decorator]
def _raise_wrong_shape(source: Any, target: Any) -> Any:  # noqa: ARG001
    """Raise without the shapes."""

    def raising(source: Any, target: Any) -> None:  # noqa: ARG001
        raise ValueError("an array is assigned to a slice of another shape")

    return raising


@contextmanager
def _short_shape_errors() -> Iterator[None]:
    """Leave the shapes out of the error of `a[:] = b`.

    Numba writes them with thirty functions on text, which take 3 to 8 s to compile.
    """
    kept = arrayobj.raise_with_shape_context
    arrayobj.raise_with_shape_context = _wrong_shape
    try:
        yield
    finally:
        arrayobj.raise_with_shape_context = kept


class _EntryFunctionCompiler(_FunctionCompiler):  # type: ignore[misc]
    """Compiles a function for Python."""

    def _customize_flags(self, flags: Any) -> Any:
        """Return flags that are compared fast."""
        return _Flags(flags)


class _PartFunctionCompiler(_FunctionCompiler):  # type: ignore[misc]
    """Compiles a function for its callers."""

    def _customize_flags(self, flags: Any) -> Any:
        """Switch off all that only Python needs."""
        flags = _Flags(flags)
        flags.no_compile = flags.no_cpython_wrapper = True
        return flags


class Kernel(CPUDispatcher):  # type: ignore[misc]  # numba has no types
    """A compiled function: an entry for Python, a part for compiled callers."""

    def __init__(
        self,
        py_func: Callable[..., object],
        locals: Any = None,
        targetoptions: Mapping[str, object] | None = None,
    ) -> None:
        options = dict(targetoptions or {})
        super().__init__(py_func, locals, options, _EntryCompiler)
        what = py_func, self.targetdescr, options, self.locals
        self._compiler = _EntryFunctionCompiler(*what, _EntryCompiler)
        self._part_compiler = _PartFunctionCompiler(*what, _PartCompiler)
        self._parts: dict[tuple[Any, ...], tuple[object, Any]] = {}

    def compile(self, sig: Any) -> Any:
        """Compile the entry for types of arguments, or load it."""
        with global_compiler_lock, _short_shape_errors():
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, Any, Any, Any]:
        """Compile the part for a caller's arguments; numba asks for its signature."""
        pysig, args = self._compiler.fold_argument_types(args, kws)
        # One part for 0 and for any other number.
        args = tuple(map(types.unliteral, args))  # type: ignore[attr-defined]
        if args not in self._parts:
            self._compile_part(args)
        template = typing.make_concrete_template(
            f"CallTemplate({self.py_func.__name__})",
            key=self.py_func.__name__,
            signatures=[part.signature for _, part in self._parts.values()],
        )
        return template, pysig, args, {}

    def get_overload(self, sig: Any) -> object:
        """Return what stands for the part in numba's tables of functions."""
        args, _ = sigutils.normalize_signature(sig)
        return self._parts[tuple(args)][0]

    def _compile_part(self, args: tuple[Any, ...]) -> None:
        """Compile the part for types of arguments and make it known to numba."""
        what = {"dispatcher": self, "args": args, "return_type": None}
        with self._compiling_counter, event.trigger_event("numba:compile", data=what):
            part = self._part_compiler.compile(args, None)
        token = object()
        self.targetctx.insert_user_function(token, part.fndesc, [part.library])
        self._parts[args] = token, part
