# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# The install tree: include/voxelpipe/voxelpipe and include/voxelpipe/cpu_ref, so that nothing beside them bears a name
# that others may have, the library of kernels where it is built, and a config file that gives the targets of the build tree.
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

install(TARGETS voxelpipe voxelpipe_cpu_ref voxelpipe_cuda voxelpipe_io EXPORT voxelpipe-targets)
install(EXPORT voxelpipe-targets NAMESPACE voxelpipe:: DESTINATION "${voxelpipe_config_dir}" COMPONENT voxelpipe)

# The compiled kernels, for their architectures and this build's compiler: a component of its own.
if(TARGET voxelpipe_cuda_kernels)
  install(
    TARGETS voxelpipe_cuda_kernels
    EXPORT voxelpipe-cuda-kernels-targets
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT cuda_kernels)
  install(EXPORT voxelpipe-cuda-kernels-targets NAMESPACE voxelpipe:: DESTINATION "${voxelpipe_config_dir}" COMPONENT cuda_kernels)
endif()

if(TARGET voxelize)
  install(TARGETS voxelize RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT tool)
endif()

configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/voxelpipe-config.cmake.in"
                              "${PROJECT_BINARY_DIR}/voxelpipe-config.cmake" INSTALL_DESTINATION "${voxelpipe_config_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/voxelpipe-config-version.cmake" COMPATIBILITY SameMinorVersion
                                 ARCH_INDEPENDENT)
install(
  FILES "${PROJECT_BINARY_DIR}/voxelpipe-config.cmake" "${PROJECT_BINARY_DIR}/voxelpipe-config-version.cmake"
        "${PROJECT_SOURCE_DIR}/cmake/voxelpipe_glm.cmake"
  DESTINATION "${voxelpipe_config_dir}"
  COMPONENT voxelpipe)
