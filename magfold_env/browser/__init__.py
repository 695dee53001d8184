"""The engine in a browser: kernels as WebAssembly, and the memory that they work on.

`python -m magfold_env.browser` writes one folder that needs no Python: one WebAssembly module
without imports that contains the kernels of `mf.simulate`, packed memory for every chain length,
and `engine.js`, which only passes numbers in and out.
"""
