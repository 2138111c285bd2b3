set(CAIRN_CXX_SOURCES
  body.cpp
  contactor.cpp
  periodic.cpp
  scene.cpp
  step.cpp
  strategy.cpp
)
