# Installs the built project into a scratch prefix, builds the README's program against it, and runs it.
# cmake -DBUILD=… -DSOURCE=… -DWORK=… -P run.cmake
file(REMOVE_RECURSE ${WORK})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${output}")
  endif()
  set(output ${output} PARENT_SCOPE)
endfunction()

file(READ ${SOURCE}/README.md readme)
file(READ ${SOURCE}/tests/package/deform.cpp program)
string(FIND "${readme}" "${program}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "README.md does not show tests/package/deform.cpp as it stands")
endif()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/package -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix
    -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/deform)
# Twice ψ3,1(1/4) = 0.6328125, of which the anchor near the edge of its support takes next to nothing.
if(NOT output MATCHES "^ *0 +0 +1\\.2656[0-9]* mm, det 0\\.9999")
  message(FATAL_ERROR "unexpected field: ${output}")
endif()
run(${WORK}/build/driver)
if(NOT output MATCHES "^-0\\.5 N")
  message(FATAL_ERROR "unexpected force: ${output}")
endif()
run(${WORK}/prefix/bin/brachyd --check-config ${WORK}/prefix/share/brachy/prostate.toml)
