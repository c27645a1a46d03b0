# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
vcpkg_download_distfile(
  ARCHIVE
  URLS "ARCHIVE_URL"
  FILENAME "voxelpipe-${VERSION}.tar.gz"
  SHA512 ARCHIVE_SHA512)
vcpkg_extract_source_archive(SOURCE_PATH ARCHIVE "${ARCHIVE}")

vcpkg_check_features(
  OUT_FEATURE_OPTIONS FEATURE_OPTIONS
  FEATURES
  cuda-kernels VOXELPIPE_BUILD_CUDA_KERNELS)
set(cuda OFF)
if("cuda-kernels" IN_LIST FEATURES)
  set(cuda ON)
else()
  set(VCPKG_BUILD_TYPE release) # headers only
endif()

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS ${FEATURE_OPTIONS} -DVOXELPIPE_ENABLE_CUDA=${cuda} -DVOXELPIPE_BUILD_TESTS=OFF -DVOXELPIPE_BUILD_SAMPLES=OFF
          -DVOXELPIPE_BUILD_BENCH=OFF -DVOXELPIPE_INSTALL=ON)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME voxelpipe CONFIG_PATH share/cmake/voxelpipe)

file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
if(NOT cuda)
  file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug" "${CURRENT_PACKAGES_DIR}/lib")
endif()
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
