# Libraries of packages of which a build takes the headers alone (deploy/packages/headers.txt). They are linked by their versioned
# names, since the names without a version come with the rest of the packages that are not wanted.
set(headers_alone ${CMAKE_SOURCE_DIR}/build/headers/usr/include)

# sixpoint_imported(TARGET libNAME.so.VERSION [HEADERS folder]): a library that any folder may link.
function(sixpoint_imported target file)
  cmake_parse_arguments(ARG "" "HEADERS" "" ${ARGN})
  find_library(${target}_FILE ${file} REQUIRED)
  add_library(${target} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${${target}_FILE})
  if(ARG_HEADERS)
    target_include_directories(${target} SYSTEM INTERFACE ${ARG_HEADERS})
  endif()
endfunction()

find_path(PROMETHEUS_HEADERS prometheus/registry.h PATHS ${headers_alone} REQUIRED)
sixpoint_imported(prometheus-cpp::core libprometheus-cpp-core.so.1.0 HEADERS ${PROMETHEUS_HEADERS})

find_path(OPENCASCADE_HEADERS Standard_Version.hxx PATH_SUFFIXES opencascade PATHS ${headers_alone} REQUIRED)
foreach(library TKernel TKMath TKG2d TKG3d TKGeomBase TKGeomAlgo TKBRep TKTopAlgo TKPrim TKBO TKBool TKShHealing TKMesh TKXSBase TKSTEP TKSTEPBase TKIGES)
  sixpoint_imported(${library} lib${library}.so.7 HEADERS ${OPENCASCADE_HEADERS})
endforeach()

find_path(PCL_HEADERS pcl/point_types.h PATH_SUFFIXES pcl-1.13 PATHS ${headers_alone} REQUIRED)
find_path(FLANN_HEADERS flann/flann.hpp PATHS ${headers_alone} REQUIRED)
foreach(library common kdtree search)
  sixpoint_imported(pcl::${library} libpcl_${library}.so.1.13 HEADERS ${PCL_HEADERS})
endforeach()
target_include_directories(pcl::search SYSTEM INTERFACE ${FLANN_HEADERS})
