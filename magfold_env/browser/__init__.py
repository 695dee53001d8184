"""The engine in a browser: its kernels as WebAssembly, and the memory that they work on.

`python -m magfold_env.browser` writes one folder that needs no Python: the kernels that
`mf.simulate` runs in one module that imports nothing, packed memory for every length of chain, and
`engine.js`, which only carries numbers in and out.
"""
