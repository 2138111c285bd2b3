# cmake -DFORTRAN= -DC= -DSOURCE= -DHEADER= -DMODULES= -DOUTPUT= -P check_prototypes.cmake
# Writes OUTPUT.c from the prototypes of SOURCE and compiles it with HEADER; OUTPUT.stamp says that both agree.
file(MAKE_DIRECTORY ${OUTPUT}.mod)
execute_process(
  COMMAND ${FORTRAN} -std=f2018 -ffree-line-length-132 -w -fopenmp -fc-prototypes -fsyntax-only -J ${OUTPUT}.mod -I ${MODULES} ${SOURCE}
  OUTPUT_VARIABLE text ERROR_VARIABLE trouble RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${SOURCE}: its prototypes cannot be written\n${trouble}")
endif()
file(READ ${HEADER} header)

# One list element a line; @ stands for the semicolon, which would split it.
string(REGEX REPLACE "/\\*[^*]*\\*/" "" text "${text}")
string(REPLACE ";" "@" text "${text}")
string(REPLACE "\n" ";" text "${text}")

set(code "")
set(record "")
foreach(line IN LISTS text)
  if(line MATCHES "^typedef struct ([A-Za-z0-9_]+) {")
    # Declared by both: the members must agree in type and place. A pointer is a pointer: type(c_ptr) does not say to what.
    set(record ${CMAKE_MATCH_1})
    string(APPEND code "struct fortran_${record} {\n")
  elseif(record AND line MATCHES "^}")
    string(APPEND code "}@\n${checks}_Static_assert(sizeof(struct fortran_${record}) == sizeof(${record}), \"${record}: size\")@\n")
    set(record "")
    set(checks "")
  elseif(record AND line MATCHES "^ +(.*[ *])([A-Za-z0-9_]+)(\\)\\(\\)|\\[[0-9]+\\])*[ ]*@")
    set(type "${CMAKE_MATCH_1}")
    set(member ${CMAKE_MATCH_2})
    string(APPEND code "${line}\n")
    string(APPEND checks "_Static_assert(offsetof(struct fortran_${record}, ${member}) == offsetof(${record}, ${member}), \"${record}.${member}: place\")@\n")
    if(NOT type MATCHES "\\*")
      string(APPEND checks "_Static_assert(_Generic(&((${record}*)0)->${member}, __typeof__(&((struct fortran_${record}*)0)->${member}): 1, default: 0), \"${record}.${member}: type\")@\n")
    endif()
  elseif(line MATCHES "^([A-Za-z_][A-Za-z0-9_ *]*[ *])([A-Za-z0-9_]+) (\\(.*)@$")
    set(result "${CMAKE_MATCH_1}")
    set(name "${CMAKE_MATCH_2}")
    # Fortran knows only that a function comes in; C checks its arguments where the caller hands it over.
    string(REGEX REPLACE "int \\(\\*([A-Za-z0-9_]+)\\)\\(\\)" "void (*\\1)()" arguments "${CMAKE_MATCH_3}")
    string(REGEX REPLACE "^cairn_" "" bare ${name})
    if(header MATCHES "typedef [A-Za-z0-9_ ]+[ *]cairn_${bare}\\(")
      # an abstract interface against the function type of the header
      string(APPEND code "${result} fortran_${name} ${arguments}@\ncairn_${bare}* check_${name}(void) { return fortran_${name}@ }\n")
    elseif(name MATCHES "^cairn_")
      string(APPEND code "void* check_${name}(void) { return (void*)&${name}@ } /* is in core.h or rows.h */\n${result} ${name} ${arguments}@\n")
    endif()
  endif()
endforeach()
string(REPLACE "@" ";" code "${code}")
file(WRITE ${OUTPUT}.c "#include \"cairn/rows.h\"\n#include <stddef.h>\n${code}")

cmake_path(GET HEADER PARENT_PATH include)
cmake_path(GET include PARENT_PATH include)
execute_process(COMMAND ${C} -std=gnu11 -Wall -Werror -Wno-strict-prototypes -fsyntax-only -I ${include} ${OUTPUT}.c
                ERROR_VARIABLE trouble RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${SOURCE} and core.h disagree (or core.h lacks it)\n${trouble}")
endif()
file(TOUCH ${OUTPUT}.stamp)
