# Install cmmlink from this folder, without a network. A start menu entry opens the console with the plans in the folder's plans.
param([string]$Folder = (Join-Path $env:LOCALAPPDATA "Programs\cmmlink"), [string]$Python = "")
$ErrorActionPreference = "Stop"

function Invoke-OrStop([string]$Program, [string[]]$Arguments) {
    & $Program @Arguments
    if ($LASTEXITCODE -ne 0) { throw "$Program ended with exit status $LASTEXITCODE" }
}

if ($Python) { $Found = @($Python) } else { $Found = @("py", "-@PYTHON@") }
if (-not (Get-Command $Found[0] -ErrorAction SilentlyContinue)) {
    throw "Python @PYTHON@ was not found. Install it from python.org, or say where it is: install.bat -Python C:\path\python.exe"
}
$Rest = @($Found | Select-Object -Skip 1)
Invoke-OrStop $Found[0] ($Rest + @("-c", "import sys; sys.exit(sys.version_info[:2] != tuple(map(int, '@PYTHON@'.split('.'))))"))

$Program = Join-Path $Folder "program"
$Plans = Join-Path $Folder "plans"
New-Item -ItemType Directory -Force $Plans | Out-Null
Invoke-OrStop $Found[0] ($Rest + @("-m", "venv", $Program))
$Own = Join-Path $Program "Scripts\python.exe"
Invoke-OrStop $Own @("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index", "--find-links", (Join-Path $PSScriptRoot "wheels"), "--requirement", (Join-Path $PSScriptRoot "versions.txt"), "cmmlink")
$Command = Join-Path $Program "Scripts\cmmlink.exe"
Invoke-OrStop $Command @("prepare")

$Menu = [Environment]::GetFolderPath("Programs")
$Link = (New-Object -ComObject WScript.Shell).CreateShortcut((Join-Path $Menu "cmmlink.lnk"))
$Link.TargetPath = $Command
$Link.Arguments = 'console "' + $Plans + '"'
$Link.WorkingDirectory = $Plans
$Link.Description = "The operator console: measure parts by the plans in " + $Plans
$Link.Save()
Write-Host "Installed. The start menu has an entry cmmlink; plans belong into $Plans"
