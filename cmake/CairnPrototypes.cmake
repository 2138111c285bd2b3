# Every kernel's own prototype (gfortran -fc-prototypes) is compiled together with core.h and rows.h: a header that says something else
# than the Fortran is a build error.
function(cairn_check_prototypes target)
  set(header ${PROJECT_SOURCE_DIR}/core_f90/include/cairn/core.h)
  set(script ${PROJECT_SOURCE_DIR}/cmake/check_prototypes.cmake)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/prototypes)
  file(MAKE_DIRECTORY ${folder})
  file(GLOB rows CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/core_f90/include/cairn/rows/*.h ${PROJECT_SOURCE_DIR}/core_f90/include/cairn/seams.h
       ${PROJECT_SOURCE_DIR}/core_f90/include/cairn/smooth_bodies.h ${PROJECT_SOURCE_DIR}/core_f90/include/cairn/fluid.h)
  set(stamps)
  foreach(source IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    cmake_path(GET source STEM name)
    add_custom_command(
      OUTPUT ${folder}/${name}.stamp
      COMMAND ${CMAKE_COMMAND} -DFORTRAN=${CMAKE_Fortran_COMPILER} -DC=${CMAKE_C_COMPILER} -DSOURCE=${path} -DHEADER=${header}
              -DMODULES=${PROJECT_BINARY_DIR}/modules -DOUTPUT=${folder}/${name} -P ${script}
      # the objects, because their modules are what a source may use
      DEPENDS ${path} ${header} ${rows} ${script} ${target} $<TARGET_OBJECTS:${target}> ${PROJECT_SOURCE_DIR}/core_f90/contact_laws/laws.def
              ${PROJECT_SOURCE_DIR}/core_f90/sides/sides.def ${PROJECT_SOURCE_DIR}/core_f90/detection/pairs.def
              ${PROJECT_SOURCE_DIR}/core_f90/solvers/solvers.def ${PROJECT_SOURCE_DIR}/core_f90/elements/elements.def
              ${PROJECT_SOURCE_DIR}/core_f90/poses/poses.def ${PROJECT_SOURCE_DIR}/core_f90/bulk_materials/bulk_materials.def
              ${PROJECT_SOURCE_DIR}/core_f90/integrators/integrators.def
              ${PROJECT_SOURCE_DIR}/core_f90/networks/networks.def
      COMMENT "Prototypes of ${source} against core.h"
      VERBATIM)
    list(APPEND stamps ${folder}/${name}.stamp)
  endforeach()
  add_custom_target(cairn_prototypes ALL DEPENDS ${stamps})
endfunction()
