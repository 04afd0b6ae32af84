# Part of `cmake --install`: units and configuration with the paths of this prefix. A prefix of /usr has its
# configuration in /etc, as the distribution does; a configuration that is there already is not overwritten.
set(bindir "${CMAKE_INSTALL_PREFIX}/bin")
set(docdir "${CMAKE_INSTALL_PREFIX}/share/doc/veneerd")
set(confdir "${CMAKE_INSTALL_PREFIX}/etc/veneerd")
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(confdir "/etc/veneerd")
endif()

foreach(unit veneerd.service veneerd-backup.service veneerd-backup.timer veneer-guardian.service veneer-twin.service
        veneer-demo.target)
  set(file "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/lib/systemd/system/${unit}")
  configure_file("${VENEER_SYSTEMD}/${unit}.in" "${file}" @ONLY)
  message(STATUS "Installed: ${file}")
endforeach()

foreach(configuration veneerd.toml veneer-twin.toml)
  set(file "$ENV{DESTDIR}${confdir}/${configuration}")
  if(EXISTS "${file}")
    message(STATUS "Kept: ${file}")
  else()
    configure_file("${VENEER_SYSTEMD}/${configuration}" "${file}" COPYONLY)
    message(STATUS "Installed: ${file}")
  endif()
endforeach()
