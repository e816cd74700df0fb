# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# The version is looked up at each build (cmake/version.sh), so a new commit or tag needs no new configuration, and only
# one small file is compiled for it. Run with -P, this file writes that one; else it defines ccslice_version, a library of
# nothing else. Where neither git nor VERSION may say it, CCSLICE_VERSION does: images are built without the history.

if(CMAKE_SCRIPT_MODE_FILE)
  if(NOT VERSION)
    execute_process(
      COMMAND "${CMAKE_CURRENT_LIST_DIR}/version.sh"
      OUTPUT_VARIABLE VERSION
      OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY
    )
  endif()
  configure_file("${CMAKE_CURRENT_LIST_DIR}/version.cpp.in" "${OUTPUT}" @ONLY) # Only if it says something else.
  return()
endif()

set(CCSLICE_VERSION "" CACHE STRING "The version; empty: what cmake/version.sh says at each build")

set(version_file "${PROJECT_BINARY_DIR}/version.cpp")
add_custom_target(
  ccslice_version_file
  COMMAND "${CMAKE_COMMAND}" -D "VERSION=${CCSLICE_VERSION}" -D "OUTPUT=${version_file}" -P "${CMAKE_CURRENT_LIST_FILE}"
  BYPRODUCTS "${version_file}"
  COMMENT "Looking up the version"
  VERBATIM
)

add_library(ccslice_version STATIC "${version_file}")
set_target_properties(ccslice_version PROPERTIES UNITY_BUILD OFF)
add_dependencies(ccslice_version ccslice_version_file)
target_link_libraries(ccslice_version PUBLIC ccslice_compile_options)
