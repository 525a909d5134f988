# Writes one ctest entry for each suite of a GoogleTest program, so that a suite is one process: what its cases share, such
# as phantoms and tables, is made once. Run after the program is linked (brachy_suites):
#   cmake -DPROGRAM=FILE -DTARGET=NAME -DFOLDER=FOLDER -DLABEL=LABEL -DRESULTS=FOLDER -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests RESULT_VARIABLE failed OUTPUT_VARIABLE listed TIMEOUT 60)
if(failed)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${failed}")
endif()
string(REPLACE ";" "," listed "${listed}")
string(REPLACE "\n" ";" lines "${listed}")
set(tests "")
foreach(line IN LISTS lines)
  if(NOT line MATCHES "^([A-Za-z0-9_/]+)\\.( |$)")
    continue()
  endif()
  set(suite ${CMAKE_MATCH_1})
  string(REPLACE "/" "_" file ${suite})
  string(APPEND tests
    "add_test([=[${suite}]=] ${PROGRAM} [=[--gtest_filter=${suite}.*]=] [=[--gtest_output=xml:${RESULTS}/${TARGET}.${file}.xml]=])\n"
    "set_tests_properties([=[${suite}]=] PROPERTIES LABELS ${LABEL} WORKING_DIRECTORY [=[${FOLDER}]=] TIMEOUT 600)\n")
endforeach()
file(WRITE ${FOLDER}/${TARGET}_suites.cmake "${tests}")
