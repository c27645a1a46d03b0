# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Used by the build and by the installed config file. GLM's config files of different years give the target glm::glm, a
# target glm, or only GLM_INCLUDE_DIRS; afterwards there is always glm::glm.
if(NOT TARGET glm::glm)
  if(TARGET glm)
    add_library(glm::glm INTERFACE IMPORTED)
    set_property(TARGET glm::glm PROPERTY INTERFACE_LINK_LIBRARIES glm)
  elseif(GLM_INCLUDE_DIRS)
    add_library(glm::glm INTERFACE IMPORTED)
    set_property(TARGET glm::glm PROPERTY INTERFACE_INCLUDE_DIRECTORIES "${GLM_INCLUDE_DIRS}")
  else()
    message(FATAL_ERROR "GLM was found but gives neither a target nor GLM_INCLUDE_DIRS")
  endif()
endif()
