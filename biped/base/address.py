"""Addresses in compiled code: a C function is called, and numbers are read, where an integer says they are.

Addresses are arguments of kernels, so what is compiled does not depend on where a library was loaded and can be kept on
disk. Whoever passes an address has checked it: a wrong one ends the process.
"""

from biped.base.jit import intrinsic

_CODE = "biped.base.address_code"

call = intrinsic(_CODE, "call")
"""(function, first, second): calls `void function(void*, void*)`."""
move = intrinsic(_CODE, "move")
"""(function, first, second, third, number): calls `void function(void*, void*, void*, double)`."""
int32_at = intrinsic(_CODE, "int32_at")
"""(address): the int32 there."""
rows_at = intrinsic(_CODE, "rows_at")
"""(address, rows, width): (rows, width) doubles whose own address is kept there, as an array that owns nothing."""
int32_rows_at = intrinsic(_CODE, "int32_rows_at")
"""The same of int32."""
doubles_at = intrinsic(_CODE, "doubles_at")
"""(address, count): the `count` doubles whose own address is kept there, as an array that owns nothing."""
