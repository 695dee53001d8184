"""The engine in a browser: kernels as WebAssembly, and the memory that they work on.

`python -m magfold_env.browser` writes one folder that needs no Python: one WebAssembly module
without imports that holds the kernels of `mf.simulate`, packed memory for every length of chain,
and `engine.js`, which only passes numbers in and out.
"""
