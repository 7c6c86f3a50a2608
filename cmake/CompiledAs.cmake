# How the sources of a folder are compiled: each says set(SIXPOINT_COMPILED_AS kernels|...). One of these is an optimisation
# and the headers that nearly all its sources include, compiled once. Only other people's headers, since a change of ours must not
# compile everything anew; a source still includes what it uses. Named with <>, so that another checkout finds the same in the
# compiler's cache. Neither JSON nor CLI11: what they leave to be instantiated is so in every source, used or not (docs/adr/0076).
set(standard_headers <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <cstdio> <cstdlib> <cstring> <functional> <limits>
  <map> <memory> <mutex> <optional> <set> <sstream> <string> <string_view> <thread> <utility> <vector>
  <absl/status/statusor.h>)
set(eigen_headers <Eigen/Cholesky> <Eigen/Core> <Eigen/Eigenvalues> <Eigen/Geometry>)
set(file_headers <filesystem> <fstream> <iomanip>)
# What generated messages and stubs include. Whoever includes it must link gRPC: it starts the library in every source.
set(grpc_headers <google/protobuf/extension_set.h> <google/protobuf/generated_enum_reflection.h>
  <google/protobuf/generated_message_bases.h> <google/protobuf/generated_message_reflection.h>
  <google/protobuf/generated_message_util.h> <google/protobuf/repeated_field.h> <google/protobuf/timestamp.pb.h>
  <google/protobuf/unknown_field_set.h> <grpcpp/grpcpp.h> <grpcpp/generic/async_generic_service.h>
  <grpcpp/impl/codegen/proto_utils.h> <grpcpp/impl/codegen/server_callback_handlers.h> <grpcpp/impl/service_type.h>
  <grpcpp/support/async_stream.h> <grpcpp/support/async_unary_call.h> <grpcpp/support/client_callback.h>
  <grpcpp/support/message_allocator.h> <grpcpp/support/method_handler.h> <grpcpp/support/server_callback.h>
  <grpcpp/support/stub_options.h> <grpcpp/support/sync_stream.h>)
set(test_headers <gmock/gmock.h> <gtest/gtest.h> <random>)

# Two thirds of a source's time are its front end's: several of one target are read as one, and their names must differ.
option(SIXPOINT_TOGETHER "Compile several sources of a target as one: sooner from nothing, later after a change of one" ON)

# sixpoint_compiled_as(NAME OPTIMISATION TOGETHER HEADER...): TOGETHER is how many sources are read as one;
# a folder whose sources are long sets NAME_together for itself
function(sixpoint_compiled_as name optimisation together)
  add_library(${name} OBJECT ${CMAKE_SOURCE_DIR}/cmake/precompiled.cc)
  target_precompile_headers(${name} PRIVATE ${ARGN})
  target_compile_options(${name} PRIVATE ${optimisation})
  target_link_libraries(${name} PRIVATE Eigen3::Eigen sixpoint::warnings)
  set(${name}_optimisation ${optimisation} CACHE INTERNAL "")
  set(${name}_together ${together} CACHE INTERNAL "")
endfunction()

# What runs long is fast; what waits for the network, the disk or a kernel is compiled fast: -O1 takes a sixth longer for it.
set(compiled_fast -Og -finline-functions -finline-small-functions)
set(SIXPOINT_KERNEL_OPTIMISATION -O3 CACHE STRING "Of metrology/; the sanitizers' presets say another")
sixpoint_compiled_as(kernels "${SIXPOINT_KERNEL_OPTIMISATION}" 8 ${standard_headers} ${eigen_headers})
sixpoint_compiled_as(storage "${compiled_fast}" 32 ${standard_headers})
sixpoint_compiled_as(services "${compiled_fast}" 24 ${standard_headers} ${file_headers} ${eigen_headers} ${grpc_headers})

# Settings of one target; the functions in SixpointTargets.cmake call it.
function(sixpoint_compile target)
  if(SIXPOINT_TOGETHER AND ${SIXPOINT_COMPILED_AS}_together GREATER 1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${${SIXPOINT_COMPILED_AS}_together})
  endif()
  target_precompile_headers(${target} REUSE_FROM ${SIXPOINT_COMPILED_AS})
  target_compile_options(${target} PRIVATE ${${SIXPOINT_COMPILED_AS}_optimisation})
endfunction()
