# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# What `cmake --install` puts where, besides the programs: the client library with its headers and CMake package, the
# contract's .proto files, and the licence. `cpack` makes a Debian package of it.

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

install(FILES "${PROJECT_SOURCE_DIR}/NOTICE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}" RENAME copyright)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ccslice)
set(CPACK_PACKAGE_VENDOR "The ccslice authors")
set(CPACK_PACKAGE_CONTACT "The ccslice authors")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
include(CPack)
