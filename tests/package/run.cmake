# Packs the Debian packages, unpacks them into a directory, builds the programs of README.md and core/README.md against
# their content, and runs them; where there is no dpkg, against what `cmake --install` leaves in a scratch prefix.
# cmake -DBUILD=… -DSOURCE=… -DWORK=… -DLAB=ON|OFF -P run.cmake
file(REMOVE_RECURSE ${WORK})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${output}")
  endif()
  set(output ${output} PARENT_SCOPE)
endfunction()

function(require_shown page program)  # the page shows the program as it stands
  file(READ ${SOURCE}/${page} text)
  file(READ ${SOURCE}/tests/package/${program} source)
  string(FIND "${text}" "${source}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "${page} does not show tests/package/${program} as it stands")
  endif()
endfunction()
require_shown(README.md simulate.cpp)
require_shown(core/README.md deform.cpp)
require_shown(net/c_api/README.md watch.c)

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
set(usr ${WORK}/prefix)
find_program(DPKG_DEB dpkg-deb)
find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
if(DPKG_DEB AND DPKG_SHLIBDEPS)
  # As fast as can be: this is about what is in them.
  run(${CMAKE_CPACK_COMMAND} --config ${BUILD}/CPackConfig.cmake -B ${WORK}/packed -D CPACK_DEBIAN_COMPRESSION_TYPE=zstd
      -D CPACK_STRIP_FILES=OFF)
  set(usr ${WORK}/root/usr)
  file(GLOB packages ${WORK}/packed/*.deb)
  list(LENGTH packages count)
  set(expected 4)
  if(EXISTS ${BUILD}/bin/brachy-import)
    math(EXPR expected "${expected} + 1")  # brachyd-import, where DCMTK is installed
  endif()
  if(LAB)
    math(EXPR expected "${expected} + 1")  # brachyd-lab
  endif()
  file(GLOB module ${BUILD}/python/brachyd_engine*.so)
  if(module)
    math(EXPR expected "${expected} + 1")  # python3-brachyd, where pybind11 is installed
  endif()
  if(NOT count EQUAL expected)
    message(FATAL_ERROR "brachyd, libbrachy-dev, libbrachyd-client0 and -dev, with DCMTK brachyd-import, with pybind11 python3-brachyd, and with the laboratory brachyd-lab expected, not: ${packages}")
  endif()
  foreach(package ${packages})
    run(${DPKG_DEB} -x ${package} ${WORK}/root)
  endforeach()
  # What `cmake --install` installs is in them, beside what only a system has.
  file(GLOB_RECURSE installed RELATIVE ${WORK}/prefix LIST_DIRECTORIES false ${WORK}/prefix/*)
  foreach(file ${installed})
    if(NOT EXISTS ${usr}/${file})
      message(FATAL_ERROR "in neither package: ${file}")
    endif()
  endforeach()
  foreach(file etc/brachyd/scene.toml lib/systemd/system/brachyd.service usr/share/doc/brachyd/copyright
               usr/share/doc/libbrachy-dev/copyright usr/share/man/man1/brachyd.1.gz
               usr/share/doc/libbrachyd-client0/copyright usr/share/doc/libbrachyd-client-dev/examples/BrachydClient.cs)
    if(NOT EXISTS ${WORK}/root/${file})
      message(FATAL_ERROR "in neither package: /${file}")
    endif()
  endforeach()
  run(${WORK}/root/usr/bin/brachyd --check-config ${WORK}/root/etc/brachyd/scene.toml)
  # Python's package has all that its environments need, and runs from where it is.
  if(module)
    run(${CMAKE_COMMAND} -E env --unset=PYTHONPATH /usr/bin/python3 ${SOURCE}/tests/package/python_package.py
        ${WORK}/root/usr/lib/python3/dist-packages ${SOURCE}/apps/python/brachyd)
  endif()
  # The bill of materials has both packages and what they depend on.
  run(python3 ${SOURCE}/scripts/package/sbom.py ${packages})
  string(JSON version GET "${output}" spdxVersion)
  if(NOT version STREQUAL "SPDX-2.3" OR NOT output MATCHES "SPDXRef-libbrachy-dev" OR NOT output MATCHES "SPDXRef-libassimp")
    message(FATAL_ERROR "unexpected bill of materials: ${output}")
  endif()
endif()
find_program(CCACHE ccache)
set(launcher)
if(CCACHE)
  set(launcher -DCMAKE_CXX_COMPILER_LAUNCHER=${CCACHE})
endif()
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/package -B ${WORK}/build -DCMAKE_PREFIX_PATH=${usr}
    -DCMAKE_CXX_FLAGS=-O0 ${launcher})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/deform)
# Twice ψ3,1(1/4) = 0.6328125, of which the anchor near the edge of its support takes next to nothing.
if(NOT output MATCHES "^ *0 +0 +1\\.2656[0-9]* mm, det 0\\.9999")
  message(FATAL_ERROR "unexpected field: ${output}")
endif()
run(${WORK}/build/simulate)
# The needle has punctured the capsule and cuts: the tissue pushes it back along −z.
if(NOT output MATCHES "^-[0-9.]+ N, det > 0\\.")
  message(FATAL_ERROR "unexpected simulation: ${output}")
endif()
run(${WORK}/build/driver)
if(NOT output MATCHES "^-0\\.5 N")
  message(FATAL_ERROR "unexpected force: ${output}")
endif()
# An adapter by the seam links client and device side; without a daemon it says so.
execute_process(COMMAND ${WORK}/build/adapter 127.0.0.1:1 RESULT_VARIABLE result ERROR_VARIABLE output)
if(NOT result EQUAL 2 OR NOT output MATCHES "nothing listens on 127.0.0.1:1")
  message(FATAL_ERROR "unexpected answer of the adapter (${result}): ${output}")
endif()
# The device example without arguments: it links, starts, and says how it is used.
execute_process(COMMAND ${WORK}/build/spacenav_device RESULT_VARIABLE result ERROR_VARIABLE output)
if(NOT result EQUAL 2 OR NOT output MATCHES "usage: spacenav_device HOST:PORT")
  message(FATAL_ERROR "unexpected answer of the device example (${result}): ${output}")
endif()
# A program in C by the C API's CMake package, and again by pkg-config; without a daemon it says so.
set(with_pkg_config ${WORK}/build/watch_by_pkg_config)
run(sh -c "PKG_CONFIG_PATH=${usr}/lib/pkgconfig && export PKG_CONFIG_PATH && \
cc -std=c99 ${SOURCE}/tests/package/watch.c -o ${with_pkg_config} $(pkg-config --cflags --libs brachyd-client)")
foreach(program ${WORK}/build/watch ${with_pkg_config})
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${usr}/lib ${program} 1
                  RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 1 OR NOT output MATCHES "nothing listens on 127.0.0.1:1")
    message(FATAL_ERROR "unexpected answer of ${program} (${result}): ${output}")
  endif()
endforeach()
run(${usr}/bin/brachyd --check-config ${usr}/share/brachy/prostate.toml)
# The laboratory's commands run where it is installed, on the installed scenes; else they name its package.
execute_process(COMMAND ${usr}/bin/brachy compare --models psi31 --scenes no_such_scene
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
set(said "install the package brachyd-lab")
if(LAB)
  set(said "no_such_scene")
endif()
if(NOT result EQUAL 2 OR NOT output MATCHES "${said}")
  message(FATAL_ERROR "unexpected answer of brachy compare (${result}): ${output}")
endif()
