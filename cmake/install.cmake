# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# What `cmake --install` puts where, besides the programs: the client library with its headers and CMake package, the
# contract's .proto files, and the licence. deploy/debian makes packages of it.

include(CMakePackageConfigHelpers)

if(CCSLICE_BUILD_CLIENT)
  set(include_dir "${CMAKE_INSTALL_INCLUDEDIR}/ccslice")
  set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/ccslice")

  set_target_properties(ccslice_client PROPERTIES EXPORT_NAME client)
  set_target_properties(ccslice_proto PROPERTIES EXPORT_NAME proto)
  install(
    TARGETS ccslice_client ccslice_proto ccslice_compile_options
    EXPORT ccslice
    ARCHIVE
    INCLUDES
    DESTINATION "${include_dir}"
  )
  install(EXPORT ccslice FILE ccslice-targets.cmake NAMESPACE ccslice:: DESTINATION "${package_dir}")

  # client.h, and what it includes.
  foreach(header IN ITEMS address cancellation client client_error credentials job layer mesh_bytes surface)
    install(FILES "${PROJECT_SOURCE_DIR}/client/${header}.h" DESTINATION "${include_dir}/client")
  endforeach()
  install(
    DIRECTORY "${PROJECT_BINARY_DIR}/proto/"
    DESTINATION "${include_dir}"
    FILES_MATCHING
    PATTERN "*.pb.h"
    PATTERN "CMakeFiles" EXCLUDE
    PATTERN "*.dir" EXCLUDE
    PATTERN "ccslice/cli" EXCLUDE
  )
  install(
    DIRECTORY "${PROJECT_SOURCE_DIR}/proto/ccslice" "${PROJECT_SOURCE_DIR}/proto/google"
    DESTINATION "${CMAKE_INSTALL_DATADIR}/ccslice/proto"
    FILES_MATCHING
    PATTERN "*.proto"
    PATTERN "ccslice/cli" EXCLUDE
  )
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs/schemas" DESTINATION "${CMAKE_INSTALL_DATADIR}/ccslice")

  configure_package_config_file(
    "${CMAKE_CURRENT_LIST_DIR}/ccslice-config.cmake.in" "${PROJECT_BINARY_DIR}/ccslice-config.cmake"
    INSTALL_DESTINATION "${package_dir}"
  )
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/ccslice-config-version.cmake" COMPATIBILITY SameMinorVersion)
  install(
    FILES "${PROJECT_BINARY_DIR}/ccslice-config.cmake" "${PROJECT_BINARY_DIR}/ccslice-config-version.cmake"
    DESTINATION "${package_dir}"
  )
endif()

# All that is installed, for those who build nothing else.
add_custom_target(ccslice_installed)
if(CCSLICE_BUILD_SERVER)
  add_dependencies(ccslice_installed ccsliced ccsliced_reference_file)
endif()
if(CCSLICE_BUILD_CLIENT)
  add_dependencies(ccslice_installed ccslice ccslice_reference_files)
endif()

install(FILES "${PROJECT_SOURCE_DIR}/NOTICE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}" RENAME copyright)
