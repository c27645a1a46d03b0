# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
class Voxelpipe < Formula
  desc "Exact triangle voxelization: headers for C++20, and a C API"
  homepage "REPOSITORY_URL"
  url "ARCHIVE_URL"
  sha256 "ARCHIVE_SHA256"
  license "Apache-2.0"

  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "glm"

  def install
    args = %w[
      -DVOXELPIPE_ENABLE_CUDA=OFF
      -DVOXELPIPE_BUILD_CAPI=ON
      -DVOXELPIPE_BUILD_TESTS=OFF
      -DVOXELPIPE_INSTALL=ON
    ]
    system "cmake", "-G", "Ninja", "-S", ".", "-B", "build", *args, *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
  end

  test do
    (testpath/"test.c").write <<~C
      #include <stdio.h>
      #include <voxelpipe.h>

      int main(void) {
        vp_context* context = NULL;
        vp_code code = vp_context_create(VP_ABI_VERSION, VP_BACKEND_CPU, 0, &context);
        vp_context_destroy(context);
        printf("%s %s", vp_version(), vp_code_name(code));
        return code == VP_OK ? 0 : 1;
      }
    C
    system ENV.cc, "test.c", "-I#{include}/voxelpipe", "-L#{lib}", "-lvoxelpipe", "-o", "test"
    assert_match version.to_s, shell_output("./test")
  end
end
