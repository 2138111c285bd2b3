# Installation for other programs: library, headers, Fortran module, find_package(Cairn), pkg-config. The headers keep
# the layout of the sources below include/cairn, because they include each other by it: C cairn/cairn.h, C++
# cairn/cxx/simulation/simulation.hpp.
include(CMakePackageConfigHelpers)

add_library(cairn_fortran INTERFACE)
set_target_properties(cairn_fortran PROPERTIES EXPORT_NAME fortran)
add_library(Cairn::fortran ALIAS cairn_fortran)
target_link_libraries(cairn_fortran INTERFACE cairn)
# a module file is read only by the compiler that wrote it
set(modules ${CMAKE_INSTALL_LIBDIR}/cairn/fortran)
target_include_directories(cairn_fortran INTERFACE
  $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/fortran> $<INSTALL_INTERFACE:${modules}>)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/Cairn)
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/cairn)
install(TARGETS cairn cairn_fortran EXPORT CairnTargets)
if(TARGET cairn_mpi) # which programs name, or the dynamic linker finds, when they ask for ranks of MPI
  install(TARGETS cairn_mpi LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
endif()
install(EXPORT CairnTargets NAMESPACE Cairn:: DESTINATION ${package})
install(DIRECTORY ${PROJECT_BINARY_DIR}/fortran/ DESTINATION ${modules} FILES_MATCHING PATTERN "cairn*.mod")
install(DIRECTORY fortran/ DESTINATION ${CMAKE_INSTALL_DATADIR}/cairn FILES_MATCHING PATTERN "cairn*.f90")
install(FILES python/cairn/plugs/cairn_plug.f90 DESTINATION ${CMAKE_INSTALL_DATADIR}/cairn)
install(DIRECTORY python/cairn/plugs/include/ DESTINATION ${CMAKE_INSTALL_DATADIR}/cairn)
install(DIRECTORY cxx/include/cairn/ core_f90/include/cairn/ ${PROJECT_BINARY_DIR}/include/cairn/ DESTINATION ${headers}
        FILES_MATCHING PATTERN "*.h" PATTERN "rows" EXCLUDE)
# headers of rows include the lists of their folders, which stand below core_f90 once installed
file(GLOB rows CONFIGURE_DEPENDS core_f90/include/cairn/rows/*.h)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${rows})
foreach(path IN LISTS rows)
  cmake_path(GET path FILENAME name)
  file(READ ${path} text)
  string(REPLACE "#include \"../../../" "#include \"../core_f90/" text "${text}")
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/installed/rows/${name} CONTENT "${text}" @ONLY)
endforeach()
install(DIRECTORY ${PROJECT_BINARY_DIR}/installed/rows DESTINATION ${headers})
install(DIRECTORY cxx DESTINATION ${headers} FILES_MATCHING PATTERN "*.hpp" PATTERN "*.def" PATTERN "include" EXCLUDE)
install(DIRECTORY core_f90 DESTINATION ${headers} FILES_MATCHING PATTERN "*.def" PATTERN "include" EXCLUDE)

configure_package_config_file(cmake/CairnConfig.cmake.in ${PROJECT_BINARY_DIR}/CairnConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/CairnConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/CairnConfig.cmake ${PROJECT_BINARY_DIR}/CairnConfigVersion.cmake DESTINATION ${package})

list(TRANSFORM fortran_runtime_of_cairn PREPEND -l)
list(JOIN fortran_runtime_of_cairn " " runtime)
list(JOIN exports_of_cairn " " exports)
set(factorisations ${CAIRN_SUITESPARSE_LIBRARIES} ${CAIRN_LAPACK_LIBRARIES})
list(JOIN factorisations " " factorisations)
# the prefix may be named, or changed, after this: cairn.pc finds it from where it stands itself, unless a folder is absolute
foreach(folder LIBDIR INCLUDEDIR)
  if(IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    set(pc_${folder} "${CMAKE_INSTALL_${folder}}")
  else()
    set(pc_${folder} "\${prefix}/${CMAKE_INSTALL_${folder}}")
  endif()
endforeach()
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(pc_prefix "${CMAKE_INSTALL_PREFIX}")
else()
  file(RELATIVE_PATH pc_prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  string(REGEX REPLACE "(.*)/$" "\${pcfiledir}/\\1" pc_prefix "${pc_prefix}")
endif()
configure_file(cmake/cairn.pc.in ${PROJECT_BINARY_DIR}/cairn.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/cairn.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
