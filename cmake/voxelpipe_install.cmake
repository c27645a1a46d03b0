# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# The install tree: include/voxelpipe/voxelpipe and include/voxelpipe/cpu_ref, so that nothing beside them bears a name
# that others may have, and a config file that gives the targets of the build tree.
include_guard(GLOBAL)
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(voxelpipe_config_dir "${CMAKE_INSTALL_DATADIR}/cmake/voxelpipe")
foreach(folder IN ITEMS voxelpipe cpu_ref)
  install(
    DIRECTORY "${PROJECT_SOURCE_DIR}/${folder}"
    DESTINATION include/voxelpipe # the include root
    COMPONENT voxelpipe
    FILES_MATCHING
    REGEX "\\.(hpp|cuh)$")
endforeach()

install(TARGETS voxelpipe voxelpipe_cpu_ref voxelpipe_cuda EXPORT voxelpipe-targets)
install(EXPORT voxelpipe-targets NAMESPACE voxelpipe:: DESTINATION "${voxelpipe_config_dir}" COMPONENT voxelpipe)

configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/voxelpipe-config.cmake.in"
                              "${PROJECT_BINARY_DIR}/voxelpipe-config.cmake" INSTALL_DESTINATION "${voxelpipe_config_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/voxelpipe-config-version.cmake" COMPATIBILITY SameMinorVersion
                                 ARCH_INDEPENDENT)
install(
  FILES "${PROJECT_BINARY_DIR}/voxelpipe-config.cmake" "${PROJECT_BINARY_DIR}/voxelpipe-config-version.cmake"
        "${PROJECT_SOURCE_DIR}/cmake/voxelpipe_glm.cmake"
  DESTINATION "${voxelpipe_config_dir}"
  COMPONENT voxelpipe)
