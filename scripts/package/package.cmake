# The manuals; and the Debian packages, which scripts/package.sh makes by CPack: brachyd, to run, and libbrachy-dev, to build against;
# brachyd-import and brachyd-lab where their programs are built; libbrachyd-client0 and libbrachyd-client-dev, the C API;
# python3-brachyd where its module is built.
# What only a system has (service, scene in /etc, documentation in /usr/share/doc) is no part of `cmake --install`.
set(BRACHY_MAINTAINER "brachyd maintainers <brachyd@example.org>" CACHE STRING "whom the Debian packages name")
set(BRACHY_RELEASE 1 CACHE STRING "the Debian packages' revision of this version")
set(here ${CMAKE_CURRENT_LIST_DIR})

# Whose help is that of `brachy import`; and of `brachy compare` and others, with a manual of its own.
set(import_program "")
if(TARGET brachy-import)
  set(import_program brachy-import)
endif()
set(lab_program "")
if(TARGET brachy-study)
  set(lab_program brachy-study)
endif()
if(NOT BRACHY_SANITIZE)
  set(manuals)
  set(programs)
  foreach(program brachyd brachy ${lab_program})
    list(APPEND manuals ${CMAKE_BINARY_DIR}/${program}.1.gz)
    list(APPEND programs $<TARGET_FILE:${program}>)
  endforeach()
  add_custom_command(
    OUTPUT ${manuals}
    COMMAND python3 ${here}/man_pages.py ${PROJECT_VERSION} ${CMAKE_BINARY_DIR} ${programs}
    DEPENDS brachyd brachy ${lab_program} ${import_program} ${here}/man_pages.py
    COMMENT "Writing the manuals"
    VERBATIM)
  add_custom_target(man_pages ALL DEPENDS ${CMAKE_BINARY_DIR}/brachyd.1.gz)
  install(FILES ${CMAKE_BINARY_DIR}/brachyd.1.gz ${CMAKE_BINARY_DIR}/brachy.1.gz
          DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT brachyd)
  if(lab_program)
    install(FILES ${CMAKE_BINARY_DIR}/brachy-study.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT lab)
  endif()
endif()

set(made ${CMAKE_BINARY_DIR}/deb)
find_program(GZIP gzip)

# zipped FILE NAME: FILE as made/NAME.gz, without a time in it. Made when CMake runs.
function(zipped file name)
  execute_process(COMMAND ${GZIP} -9nc ${file} OUTPUT_FILE ${made}/${name}.gz COMMAND_ERROR_IS_FATAL ANY)
endfunction()

function(system_files directory)
  install(FILES ${ARGN} DESTINATION ${directory} COMPONENT brachyd EXCLUDE_FROM_ALL)
endfunction()

if(GZIP AND NOT BRACHY_SANITIZE)
  file(MAKE_DIRECTORY ${made})
  configure_file(${here}/changelog.in ${made}/changelog @ONLY)
  zipped(${made}/changelog changelog.Debian)
  zipped(${PROJECT_SOURCE_DIR}/net/PROTOCOL.md PROTOCOL.md)
  configure_file(${PROJECT_SOURCE_DIR}/config/prostate.toml ${made}/scene.toml COPYONLY)
  system_files(/etc/brachyd ${made}/scene.toml)
  system_files(/lib/systemd/system ${PROJECT_SOURCE_DIR}/config/systemd/brachyd.service)
  system_files(/usr/share/doc/brachyd ${here}/copyright ${made}/changelog.Debian.gz ${made}/PROTOCOL.md.gz
               ${PROJECT_SOURCE_DIR}/net/IGTL.md)
  install(FILES ${here}/copyright ${made}/changelog.Debian.gz DESTINATION /usr/share/doc/libbrachy-dev
          COMPONENT dev EXCLUDE_FROM_ALL)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "${BRACHY_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL brachyd dev)
if(BRACHY_IMPORT)
  list(APPEND CPACK_COMPONENTS_ALL import)
  install(FILES ${here}/copyright ${made}/changelog.Debian.gz DESTINATION /usr/share/doc/brachyd-import
          COMPONENT import EXCLUDE_FROM_ALL)
endif()
if(lab_program)
  list(APPEND CPACK_COMPONENTS_ALL lab)
  install(FILES ${here}/copyright ${made}/changelog.Debian.gz DESTINATION /usr/share/doc/brachyd-lab
          COMPONENT lab EXCLUDE_FROM_ALL)
endif()
if(TARGET brachyd_client)
  list(APPEND CPACK_COMPONENTS_ALL client client_dev)
  set(examples /usr/share/doc/libbrachyd-client-dev/examples)
  install(FILES ${here}/copyright ${made}/changelog.Debian.gz DESTINATION /usr/share/doc/libbrachyd-client0
          COMPONENT client EXCLUDE_FROM_ALL)
  install(FILES ${here}/copyright ${made}/changelog.Debian.gz DESTINATION /usr/share/doc/libbrachyd-client-dev
          COMPONENT client_dev EXCLUDE_FROM_ALL)
  install(FILES ${PROJECT_SOURCE_DIR}/apps/examples/gland_view.c ${PROJECT_SOURCE_DIR}/apps/csharp/BrachydClient.cs
                ${PROJECT_SOURCE_DIR}/apps/csharp/examples/GlandMesh.cs
          DESTINATION ${examples} COMPONENT client_dev EXCLUDE_FROM_ALL)
  # For whoever writes a client: the schema with its golden bytes, the documents, the vectors of forces and the judge, in
  # the tree that they have here, by which they find each other.
  set(protocol /usr/share/brachyd-protocol)
  foreach(file net/protocol.json net/PROTOCOL.md net/REFUSALS.md net/IGTL.md tests/haptics/local_model_vectors.json
               scripts/conformance/README.md scripts/conformance/conversations.py scripts/conformance/judge.py
               scripts/conformance/live.py scripts/ci/wire_schema.py tests/conformance/client.c
               tests/conformance/client.cpp tests/conformance/client.py tests/conformance/Client.cs)
    get_filename_component(folder ${file} DIRECTORY)
    install(FILES ${PROJECT_SOURCE_DIR}/${file} DESTINATION ${protocol}/${folder} COMPONENT client_dev EXCLUDE_FROM_ALL)
  endforeach()
  install(PROGRAMS ${PROJECT_SOURCE_DIR}/scripts/conformance/run.py DESTINATION ${protocol}/scripts/conformance
          COMPONENT client_dev EXCLUDE_FROM_ALL)
endif()
if(TARGET brachyd_engine)
  list(APPEND CPACK_COMPONENTS_ALL python)
  # Where Debian's Python looks; the module is of its version alone.
  set(python_packages /usr/lib/python3/dist-packages)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/apps/python/brachyd DESTINATION ${python_packages}
          COMPONENT python EXCLUDE_FROM_ALL FILES_MATCHING PATTERN *.py PATTERN *.pyi PATTERN py.typed
          PATTERN __pycache__ EXCLUDE)
  install(TARGETS brachyd_engine LIBRARY DESTINATION ${python_packages}/brachyd COMPONENT python EXCLUDE_FROM_ALL)
  install(FILES ${here}/copyright ${made}/changelog.Debian.gz ${PROJECT_SOURCE_DIR}/apps/python/README.md
          DESTINATION /usr/share/doc/python3-brachyd COMPONENT python EXCLUDE_FROM_ALL)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/apps/python/examples DESTINATION /usr/share/doc/python3-brachyd
          COMPONENT python EXCLUDE_FROM_ALL FILES_MATCHING PATTERN *.py PATTERN __pycache__ EXCLUDE)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${BRACHY_RELEASE})
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_BRACHYD_PACKAGE_NAME brachyd)
set(CPACK_DEBIAN_BRACHYD_PACKAGE_SECTION science)
set(CPACK_DEBIAN_BRACHYD_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_BRACHYD_PACKAGE_DEPENDS procps)  # the unit reloads by /bin/kill
set(CPACK_DEBIAN_BRACHYD_PACKAGE_SUGGESTS "nats-server, brachyd-import, brachyd-lab")
set(CPACK_DEBIAN_BRACHYD_PACKAGE_CONTROL_EXTRA ${here}/postinst ${here}/prerm ${here}/postrm ${here}/conffiles)
set(CPACK_DEBIAN_BRACHYD_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_BRACHYD_DESCRIPTION
    "real-time brachytherapy simulator: a needle deforms a prostate
The daemon brachyd takes needle poses over TCP, deforms soft tissue around
the needles 200 times a second and streams the result to any number of
viewers, a browser and 3D Slicer among them. Trainees drop seeds to a plan,
and their dose is scored. The tools of brachy replay, watch, record, plan and
score. The daemon is installed as a systemd service that listens
on loopback.
For research and training. Not a medical device.")

set(CPACK_DEBIAN_IMPORT_PACKAGE_NAME brachyd-import)
set(CPACK_DEBIAN_IMPORT_PACKAGE_SECTION science)
set(CPACK_DEBIAN_IMPORT_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_IMPORT_PACKAGE_DEPENDS "brachyd (= ${PROJECT_VERSION}-${BRACHY_RELEASE})")
set(CPACK_DEBIAN_IMPORT_DESCRIPTION
    "scenes of DICOM RT files for the brachytherapy simulator brachyd
The program brachy-import, which `brachy import` and `brachy export --dicom`
start: it makes a scene of a patient's DICOM RT structures, plan and dose, or
of a label map (NRRD, NIfTI), and writes a scene and its plan as DICOM RT.
For research and training. Not a medical device.")

set(CPACK_DEBIAN_LAB_PACKAGE_NAME brachyd-lab)
set(CPACK_DEBIAN_LAB_PACKAGE_SECTION science)
set(CPACK_DEBIAN_LAB_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LAB_PACKAGE_DEPENDS "brachyd (= ${PROJECT_VERSION}-${BRACHY_RELEASE})")
set(CPACK_DEBIAN_LAB_DESCRIPTION
    "accuracy and failure of the models of the simulator brachyd
The program brachy-study, which `brachy compare`, `ticks`, `stability`,
`zwidth` and `deflection` start, with the reference scenes that it compares
the deformation models and other methods with.
For research and training. Not a medical device.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libbrachy-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    # zlib1g-dev is missing in libassimp-dev's own dependencies.
    "libeigen3-dev (>= 3.4), libassimp-dev, libtomlplusplus-dev, libcap-dev, zlib1g-dev, libboost-dev (>= 1.74), libssl-dev (>= 3.0)")
set(CPACK_DEBIAN_DEV_DESCRIPTION
    "soft tissue deformed by landmarks: libraries of the simulator brachyd
Static C++20 libraries with their headers and CMake package
(find_package(brachy)). brachy::core is the engine: radial basis functions of
compact support and elastic models, needle contact, seeds, TG-43 dose.
brachy::net is the client library of brachyd's protocol, for viewers and
devices. brachy::haptics is the device side: force from a local contact model,
trajectories, pose checks.")

set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME libbrachyd-client0)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SHLIBDEPS ON)
# Beside CPack's own scripts, which call ldconfig: the trigger and the file that Debian's tools look for.
file(CONFIGURE OUTPUT ${made}/client/triggers CONTENT "activate-noawait ldconfig\n")
file(CONFIGURE OUTPUT ${made}/client/shlibs CONTENT "libbrachyd-client 0 libbrachyd-client0 (>= ${PROJECT_VERSION})\n")
set(CPACK_DEBIAN_CLIENT_PACKAGE_CONTROL_EXTRA ${made}/client/triggers ${made}/client/shlibs)
set(CPACK_DEBIAN_CLIENT_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_CLIENT_DESCRIPTION
    "client library of the brachytherapy simulator brachyd
Viewers and haptic devices written in C, C# and other languages connect to
the daemon brachyd by this library: mesh, needles, seeds, forces, ultrasound
images, events.
For research and training. Not a medical device.")

set(CPACK_DEBIAN_CLIENT_DEV_PACKAGE_NAME libbrachyd-client-dev)
set(CPACK_DEBIAN_CLIENT_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_CLIENT_DEV_PACKAGE_DEPENDS
    "python3:any, libbrachyd-client0 (= ${PROJECT_VERSION}-${BRACHY_RELEASE})")  # Python runs the judge
set(CPACK_DEBIAN_CLIENT_DEV_DESCRIPTION
    "client library of the brachytherapy simulator brachyd: C header
The header brachyd_client.h (C99), brachyd-client for pkg-config and CMake
(find_package(brachyd-client), brachyd::client). Examples: a viewer with
OpenGL, the binding for C#, a script for Unity. In /usr/share/brachyd-protocol
the protocol's schema, documents and vectors, and the judge of clients,
scripts/conformance/run.py.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-brachyd)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
math(EXPR next_python "${Python_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next_python}), python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${here}/python/postinst ${here}/python/prerm)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "brachyd (= ${PROJECT_VERSION}-${BRACHY_RELEASE})")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION
    "brachytherapy simulator brachyd for Python: clients and environments
Viewers, devices and operators of the daemon brachyd, and its engine in the
process: as many ticks as the processor makes, and environments for needle
steering, alone or many on several processes, as Gymnasium has them.
For research and training. Not a medical device.")
include(CPack)
