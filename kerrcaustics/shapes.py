"""Types of arrays in signatures, with shapes: `Float[Array, "n 3"]`.

They are those of jaxtyping to type checkers, and wherever jaxtyping is loaded first, as it is by the tests, which check
them. Users' programs check nothing, and would load jaxtyping as long as NumPy: to them the type of an array stands for
it with every shape.
"""

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or "jaxtyping" in sys.modules:
    from jaxtyping import (
        Bool as Bool,
        Complex as Complex,
        Float as Float,
        Float16 as Float16,
        Float32 as Float32,
        Int as Int,
        Num as Num,
        Real as Real,
        Shaped as Shaped,
        UInt8 as UInt8,
    )
else:

    class _AnyShape:
        """The type of an array, whatever its numbers and its shape are."""

        def __getitem__(self, array_and_shape: tuple[Any, str]) -> Any:
            return array_and_shape[0]

    Bool = Complex = Float = Float16 = Float32 = Int = Num = Real = Shaped = UInt8 = _AnyShape()
