@echo off
rem Install cmmlink from this folder, without a network. Python @PYTHON@ has to be there; it needs no administrator.
powershell -NoProfile -ExecutionPolicy Bypass -File "%~dp0install.ps1" %*
if errorlevel 1 pause
