set(CAIRN_CORE_SOURCES
  integrators/energy.f90
  integrators/rotation.f90
  integrators/theta.f90
)
