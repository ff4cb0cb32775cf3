# terrane_folder(NAME SOURCES ... LINK ... PRIVATE_LINK ... TESTS ... TEST_LINK ... TEST_FIXTURES ... SHARED_SUITES ...)
#
# One folder of src/: a static library `terrane_NAME` whose public headers are include/terrane/NAME,
# and one GoogleTest program `test_NAME` from the files in test/. A folder sees only the headers of the
# folders that it links, so an include against the flow of the data fails to compile.
function(terrane_folder name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK;TESTS;TEST_LINK;TEST_FIXTURES;SHARED_SUITES" ${ARGN})
  set(target terrane_${name})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    target_include_directories(${target} PUBLIC include PRIVATE src)
    target_link_libraries(${target} PUBLIC ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
    terrane_warnings(${target})
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target} INTERFACE include)
    target_link_libraries(${target} INTERFACE ${ARG_LINK})
  endif()
  if(TERRANE_TESTS AND ARG_TESTS)
    add_executable(test_${name} ${ARG_TESTS})
    target_include_directories(test_${name} PRIVATE src test ${PROJECT_SOURCE_DIR}/tests/support)
    target_link_libraries(test_${name} PRIVATE ${target} ${ARG_PRIVATE_LINK} ${ARG_TEST_LINK} GTest::gtest GTest::gtest_main)
    target_compile_definitions(test_${name} PRIVATE TERRANE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    terrane_warnings(test_${name})
    if(EMSCRIPTEN)
      # In node, with its files. Linking is where the compiler optimises: thoroughly only what is measured or delivered.
      target_link_options(test_${name} PRIVATE -sNODERAWFS=1 -sEXIT_RUNTIME=1 -sALLOW_MEMORY_GROWTH=1 -O1)
    endif()
    terrane_discover_tests(test_${name} LABEL ${name} FIXTURES ${ARG_TEST_FIXTURES} SHARED_SUITES ${ARG_SHARED_SUITES})
  endif()
endfunction()

# terrane_discover_tests(PROGRAM LABEL ... FIXTURES ... SHARED_SUITES ...)
#
# Every test of a GoogleTest program is one of CTest's, in a process of its own, but for suites whose set-up takes
# seconds: each of those is one test as a whole. The program's own files are compiled a fifth faster than with -O2.
function(terrane_discover_tests program)
  target_compile_options(${program} PRIVATE $<$<CONFIG:RelWithDebInfo>:-O1>)
  cmake_parse_arguments(ARG "" "LABEL" "FIXTURES;SHARED_SUITES" ${ARGN})
  set(filter "*")
  set(separator "-")
  foreach(suite IN LISTS ARG_SHARED_SUITES)
    string(APPEND filter "${separator}${suite}.*")
    set(separator ":")
    add_test(NAME ${suite} COMMAND ${program} --gtest_filter=${suite}.*)
    set_tests_properties(${suite} PROPERTIES LABELS ${ARG_LABEL} FIXTURES_REQUIRED "${ARG_FIXTURES}")
  endforeach()
  gtest_discover_tests(${program} DISCOVERY_TIMEOUT 60 TEST_FILTER "${filter}"
    PROPERTIES LABELS ${ARG_LABEL} FIXTURES_REQUIRED "${ARG_FIXTURES}")
endfunction()

# Warnings are errors; floats are never contracted, so that every machine computes the same heights.
function(terrane_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
    -Werror -ffp-contract=off
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>  # false alarms from std::string::insert in g++ 12
    $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)  # takes the files of a unity build for headers
  if(TERRANE_SANITIZE)
    # note: g++ 12 loses track of sizes in instrumented code, and warns of overflows that cannot happen.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
      $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>)
    target_compile_options(${target} PRIVATE -fsanitize=${TERRANE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PRIVATE -fsanitize=${TERRANE_SANITIZE})
  endif()
endfunction()

# terrane_embed_shaders(VARIABLE HEADER ... FUNCTION ... FILES ...)
#
# Shaders that travel inside a library: VARIABLE becomes a source file with a function FUNCTION, declared in HEADER,
# that gives them.
set(TERRANE_EMBED_SHADERS ${CMAKE_CURRENT_LIST_DIR}/embed_shaders.cmake)
function(terrane_embed_shaders variable)
  cmake_parse_arguments(ARG "" "HEADER;FUNCTION" "FILES" ${ARGN})
  set(output ${CMAKE_CURRENT_BINARY_DIR}/shader_library.cpp)
  string(REPLACE ";" "|" files "${ARG_FILES}")
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DHEADER=${ARG_HEADER} -DFUNCTION=${ARG_FUNCTION} "-DFILES=${files}"
      -P ${TERRANE_EMBED_SHADERS}
    DEPENDS ${ARG_FILES} ${TERRANE_EMBED_SHADERS}
    COMMENT "Embedding shaders" VERBATIM)
  set(${variable} ${output} PARENT_SCOPE)
endfunction()

# terrane_fuzzer(NAME SOURCES ... CORPUS folder LINK ...)
#
# A libFuzzer program `fuzz_NAME`, in builds with TERRANE_FUZZERS only (the clang preset). Its stored corpus is
# a test of that build; `./dev fuzz` runs every fuzzer for a while, starting from the corpus.
file(REMOVE_RECURSE ${CMAKE_BINARY_DIR}/fuzzers)
function(terrane_fuzzer name)
  if(NOT TERRANE_FUZZERS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "CORPUS" "SOURCES;LINK" ${ARGN})
  set(target fuzz_${name})
  set(corpus ${CMAKE_CURRENT_SOURCE_DIR}/${ARG_CORPUS})
  add_executable(${target} ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE ${ARG_LINK})
  terrane_warnings(${target})
  target_link_options(${target} PRIVATE -fsanitize=fuzzer)
  file(WRITE ${CMAKE_BINARY_DIR}/fuzzers/${target} "${corpus}\n")
  if(TERRANE_TESTS)
    add_test(NAME ${target}_corpus COMMAND ${target} -runs=0 ${corpus})
    set_tests_properties(${target}_corpus PROPERTIES LABELS fuzz)
  endif()
endfunction()
