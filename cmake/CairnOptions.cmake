# Options of the build, and the flags that follow from them.
option(BUILD_SHARED_LIBS "Build libcairn as a shared library" OFF)
option(CAIRN_PYTHON "Build the Python module cairn._core" ON)
option(CAIRN_TESTS "Build the C++ tests" ${PROJECT_IS_TOP_LEVEL})
option(CAIRN_BENCHMARKS "Build the benchmark programs" ${PROJECT_IS_TOP_LEVEL})
option(CAIRN_WERROR "Treat warnings as errors" OFF)
option(CAIRN_SANITIZE "Address and undefined-behaviour sanitizers" OFF)
option(CAIRN_SANITIZE_THREADS "The thread sanitizer, over an OpenMP of its own (tests/thread_sanitizer)" OFF)
option(CAIRN_FCHECK "Run-time checks of the Fortran kernels (bounds, do, pointers), NaN and huge integers in what is not set" OFF)
option(CAIRN_PRECOMPILE "Read the headers that most files include once, unless ccache compiles" OFF)
option(CAIRN_UNITY "Compile the sources of a folder together: a third of the time from nothing, longer after a change" OFF)
set(CAIRN_MARCH "native" CACHE STRING "native, portable (x86-64-v2 on Intel and AMD) or a value of -march")
set(CAIRN_CONTRACT "fast" CACHE STRING "fast: products and sums of kernels may be fused; off: each is rounded")
set_property(CACHE CAIRN_CONTRACT PROPERTY STRINGS fast off)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Kind of build" FORCE)
endif()

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 11)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_COLOR_DIAGNOSTICS ON)
foreach(language C CXX Fortran)
  set(CMAKE_${language}_FLAGS_RELEASE "-O3")
endforeach()

if(CAIRN_PRECOMPILE AND CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  set(CAIRN_PRECOMPILE OFF) # it would keep nothing
endif()

find_package(OpenMP REQUIRED COMPONENTS CXX Fortran)

# Flags of Cairn's own code, not of included libraries; programs that link with Cairn do not inherit them.
add_library(cairn_flags INTERFACE)
target_link_libraries(cairn_flags INTERFACE OpenMP::OpenMP_CXX OpenMP::OpenMP_Fortran)

if(CAIRN_MARCH STREQUAL "native")
  set(march -march=native)
elseif(NOT CAIRN_MARCH STREQUAL "portable")
  set(march -march=${CAIRN_MARCH})
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(march -march=x86-64-v2)
else()
  set(march "")
endif()
# A fused multiply-add commutes with powers of two, so contraction keeps the bits of a rescaled scene. No flag here lets
# the compiler reorder a sum. In C++ nothing is fused: the choice of products would depend on which files are compiled
# together (CAIRN_UNITY).
if(NOT CAIRN_CONTRACT MATCHES "^(fast|off)$")
  message(FATAL_ERROR "CAIRN_CONTRACT is '${CAIRN_CONTRACT}': give fast or off")
endif()
target_compile_options(cairn_flags INTERFACE ${march}
  "$<IF:$<COMPILE_LANGUAGE:Fortran>,-ffp-contract=${CAIRN_CONTRACT},-ffp-contract=off>")

set(cxx_warnings -Wall -Wextra)
# A law or a pair answers to one signature, whether it needs every argument or not.
# views of workspace live in the caller: target-lifetime would ask for more than Fortran can say
set(fortran_warnings -Wall -Wextra -Wno-unused-dummy-argument -Wno-target-lifetime -fimplicit-none -std=f2018 -ffree-line-length-132)
if(CAIRN_WERROR)
  list(APPEND cxx_warnings -Werror)
  list(APPEND fortran_warnings -Werror)
endif()
target_compile_options(cairn_flags INTERFACE
  "$<$<COMPILE_LANGUAGE:C,CXX>:${cxx_warnings}>"
  "$<$<COMPILE_LANGUAGE:CXX>:-fno-math-errno>"
  "$<$<COMPILE_LANGUAGE:Fortran>:${fortran_warnings}>")

if(CAIRN_FCHECK)
  # A variable or a member of a record that is read before it is set is a signalling NaN, or an index out of every array. Invalid
  # operations are not trapped, since kernels compute lanes that they discard, 0/0 among them: tests see the NaN in results.
  target_compile_options(cairn_flags INTERFACE
    "$<$<COMPILE_LANGUAGE:Fortran>:-fcheck=all,no-array-temps;-finit-real=snan;-finit-integer=-99999999;-finit-derived;-fbacktrace>")
endif()
if(CAIRN_SANITIZE)
  target_compile_options(cairn_flags INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  # gfortran takes the address of the first number of an absent optional array when it passes that on, and reads nothing there
  target_compile_options(cairn_flags INTERFACE $<$<COMPILE_LANGUAGE:Fortran>:-fno-sanitize=null>)
  target_link_options(cairn_flags INTERFACE -fsanitize=address,undefined)
endif()
if(CAIRN_SANITIZE_THREADS)
  target_compile_options(cairn_flags INTERFACE -fsanitize=thread -fno-omit-frame-pointer)
  target_link_options(cairn_flags INTERFACE -fsanitize=thread)
endif()
