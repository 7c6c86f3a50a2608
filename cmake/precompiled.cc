// Nothing: CMake compiles precompiled headers beside a source of the target that owns them.
